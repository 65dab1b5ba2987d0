// SPDX-License-Identifier: MIT
// What widgets see of a user panel: pins with values, and functions that are called when they
// change.

/**
 * @typedef {boolean | number | string | null} Value
 */

export class Pins {
    /**
     * @param {Record<string, {value: Value, unit?: string}>} pins
     * @param {(values: Record<string, Value>) => void} send sends what was written to outputs, once
     *     for all that is written before the next microtask
     * @param {() => boolean} mayWrite
     */
    constructor(pins, send, mayWrite) {
        this.pins = pins;
        this.send = send;
        this.mayWrite = mayWrite;
        this.values = new Map(Object.entries(pins).map(([name, pin]) => [name, pin.value]));
        /** @type {Map<string, ((value: Value) => void)[]>} */
        this.bound = new Map();
        /** @type {Map<string, ((value: Value) => void)[]>} */
        this.sources = new Map();
        /** @type {Record<string, Value>} */
        this.waiting = {};
        this.ready = false;
        /** @type {(() => void)[]} */
        this.release = [];  // called when the page is hidden or left
        /** @type {(() => void)[]} */
        this.ends = [];  // called when the view is left
    }

    value(name) { return this.values.get(name); }

    /// The unit of a pin; empty: none, or no such pin.
    unit(name) { return this.pins[name]?.unit ?? ''; }

    /// Calls act(value) now and at each change.
    bind(name, act) {
        if (!name) return;
        if (!this.bound.has(name)) this.bound.set(name, []);
        this.bound.get(name).push(act);
        act(this.values.get(name));
    }

    /// The same for a name of the machine, without a pin of the panel.
    source(name, act) {
        if (!this.sources.has(name)) this.sources.set(name, []);
        this.sources.get(name).push(act);
    }

    set(name, value) {
        this.values.set(name, value);
        for (const act of this.bound.get(name) ?? [])
            act(value);
    }

    /// Sets outputs.
    write(values) {
        if (!this.mayWrite()) return;
        for (const [name, value] of Object.entries(values))
            this.set(name, value);
        if (Object.keys(this.waiting).length === 0)
            queueMicrotask(() => {
                const waiting = this.waiting;
                this.waiting = {};
                this.send(waiting);
            });
        Object.assign(this.waiting, values);
    }

    /// Lets go of what is held down.
    releaseAll() { this.release.forEach(act => act()); }
}
