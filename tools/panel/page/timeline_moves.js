// SPDX-License-Identifier: MIT
// The moves of a time line that wait for the one that is under way, and texts of its times.

/// A time of the journal with as many digits as its cycles need.
export const timeText = ns => `${(ns / 1e9).toFixed(6)} s`;

/// Where a time is, in percent of the whole journal.
export const percent = (ns, end_ns) =>
    end_ns > 0 ? Math.min(100, Math.max(0, 100 * ns / end_ns)) : 0;

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
