// SPDX-License-Identifier: MIT
// A trigger on faults. A source of this trigger is written 'fault:' or 'fault:NAME'; no name of the
// machine has a colon.

const prefix = 'fault:';

/// Whether a source of triggers is faults.
export const isFaultSource = source => source.startsWith(prefix);
/// The source of the faults of a name; '': of all faults.
export const faultSource = name => prefix + name;
/// The name of which a source has the faults; '' for all faults.
export const nameOfFaults = source => source.slice(prefix.length);

/**
 * Whether a fault is one of an instance or of a thread: it begins with the name, it is of a pin or
 * a function of the instance, or it names the instance to look at.
 * @param {string} text of the fault
 * @param {string} name of an instance or a thread; '' for all
 */
export function concerns(text, name) {
    if (name === '' || text.startsWith(`${name}: `)) return true;
    const [, instance] = /; see: show pin (\S+)$/.exec(text) ?? [];
    if (instance) return instance === name;
    return text.includes(`'${name}'`) || text.includes(`'${name}.`);
}

/** Finds faults as the journal reports them, like Trigger finds edges. */
export class FaultTrigger {
    /**
     * @param {string} name of an instance or a thread; '' for all
     * @param {() => {at: number, text: string}[]} faults all known ones, s
     */
    constructor(name, faults) {
        this.name = name;
        this.faults = faults;
        this.last = Math.max(-Infinity, ...faults().map(one => one.at));
    }
    /// Returns the times of the faults since the last call.
    scan() {
        const found = this.faults()
                          .filter(({at, text}) => at > this.last && concerns(text, this.name))
                          .map(one => one.at)
                          .sort((a, b) => a - b);
        if (found.length > 0) this.last = found[found.length - 1];
        return found;
    }
}
