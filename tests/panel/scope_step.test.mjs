// SPDX-License-Identifier: MIT
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {Store} from '../../tools/panel/page/scope_data.js';
import {stepResponse} from '../../tools/panel/page/scope_step.js';

/// A store with one channel, `value(t)` every 0.1 ms from 0 to `end` s.
function recorded(end, value) {
    const store = new Store();
    store.layout([{columns: [0]}], ['y']);
    for (let i = 0; i <= end * 1e4; i++)
        store.values({time_ns: i * 1e5, values: [value(i * 1e-4)], skipped: 0});
    return store;
}

const close = (a, b, by, what) => assert.ok(Math.abs(a - b) <= by, `${what}: ${a}, not ${b}`);

test('a first-order lag rises in ln 9 and settles in ln 50 time constants', () => {
    for (const [initial, final] of [[0, 1], [2, -3], [100, 100.5]]) {
        const tau = .02, y = t => final + (initial - final) * Math.exp(-t / tau);
        const found = stepResponse(recorded(.4, y), 'y', 0, .4);
        close(found.initial, initial, 1e-9, 'initial');
        close(found.final, final, 1e-6, 'final');
        close(found.rise, tau * Math.log(9), 1e-4, 'rise time');
        close(found.settling, tau * Math.log(50), 1e-4, 'settling time');
        assert.ok(found.overshoot < 1e-3);
    }
});

test('a second-order system with damping 0.5 overshoots by 16.3 %', () => {
    const d = .5, w = 100, wd = w * Math.sqrt(1 - d * d), phase = Math.acos(d);
    const y = t => 1 - Math.exp(-d * w * t) / Math.sqrt(1 - d * d) * Math.sin(wd * t + phase);
    for (const sign of [1, -1]) {
        const found = stepResponse(recorded(.4, t => sign * y(t)), 'y', 0, .4);
        close(
            found.overshoot, 100 * Math.exp(-Math.PI * d / Math.sqrt(1 - d * d)), .01, 'overshoot');
        close(found.rise, .01638, 1e-4, 'rise time');  // of the exact response, by bisection
        close(found.settling, .08077, 1e-4, 'settling time');
    }
});

test('a response that does not stay near its end has no settling time', () => {
    const found =
        stepResponse(recorded(1, t => (t < .1 ? 0 : 1 + .1 * Math.sin(300 * t))), 'y', 0, 1);
    assert.equal(found.settling, null);
    close(found.final, 1, .02, 'final');
});

test('a constant, a missing channel and noise without a step are no step responses', () => {
    assert.equal(stepResponse(recorded(.1, () => 3), 'y', 0, .1), null);
    assert.equal(stepResponse(recorded(.1, () => NaN), 'y', 0, .1), null);
    assert.equal(stepResponse(recorded(.1, t => t), 'other', 0, .1), null);
    assert.equal(stepResponse(recorded(.1, t => t), 'y', -.01, .1), null);
    assert.equal(stepResponse(recorded(.1, t => .1 + Math.sin(1e4 * t)), 'y', 0, .1), null);
    assert.equal(stepResponse(recorded(.1, t => Math.sin(1e4 * t)), 'y', 0, .0998), null);
});
