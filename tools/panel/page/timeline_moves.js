// SPDX-License-Identifier: MIT
// The moves of a time line that wait for the one that is under way, and its texts.

/// A time of the journal with as many digits as its cycles need.
export const timeText = ns => `${(ns / 1e9).toFixed(6)} s`;

/// Where a time is, in percent of the whole journal.
export const percent = (ns, end_ns) =>
    end_ns > 0 ? Math.min(100, Math.max(0, 100 * ns / end_ns)) : 0;

/**
 * The line below the time line: why the last move was not made, where the execution is, how long
 * going back takes without keyframes, and what is missing of the journal.
 */
export function noteText(problem, moment, notes = []) {
    const parts = [];
    if (problem) parts.push(problem);
    if (moment?.moving) parts.push(`executing the journal: ${timeText(moment.time_ns)}`);
    const why = moment?.state?.trim() ?? '';
    if (why && why !== 'interrupted') parts.push(why);
    if (moment?.copied === false && moment.took_ms !== undefined)
        parts.push(
            'without keyframes: going back executes the journal from its begin; the last ' +
            `move took ${(moment.took_ms / 1000).toFixed(2)} s`);
    const left_out = moment?.left_out ?? 0;
    if (left_out === 1) parts.push('1 further mark is not shown');
    if (left_out > 1) parts.push(`${left_out} further marks are not shown`);
    return [...parts, ...notes].join('; ');
}

/**
 * Puts moves together while one is under way: of several times the newest counts, and steps add up.
 */
export class Moves {
    constructor() {
        /** @type {string[] | null} */
        this.words = null;  // any other move
        this.steps = 0;     // behind it
        this.thread = '';   // of the steps
    }

    /// Adds a move that replaces those that wait.
    add(words) {
        this.words = words;
        this.steps = 0;
    }

    addSteps(count, thread) {
        if (thread !== this.thread) this.steps = 0;
        this.thread = thread;
        this.steps += count;
    }

    /// The words of the next command; null when nothing waits.
    next() {
        const {words, steps, thread} = this;
        if (words) {
            this.words = null;
            return words;
        }
        if (steps === 0) return null;
        this.steps = 0;
        const count = String(Math.abs(steps)), of = thread ? [thread] : [];
        return steps < 0 ? ['step', 'back', count, ...of] : ['step', count, ...of];
    }
}
