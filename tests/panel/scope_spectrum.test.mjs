// SPDX-License-Identifier: MIT
import assert from 'node:assert/strict';
import test from 'node:test';

import {spectrum} from '../../tools/panel/page/scope_spectrum.js';

/// A store with one channel 'x' of values sampled every `period` seconds.
function store(values, period = 1e-3) {
    const group = {
        first: 0,
        count: values.length,
        time: row => row * period,
        value: (column, row) => values[row],
        row: time => Math.min(values.length, Math.max(0, Math.ceil(time / period - 1e-9)))
    };
    return {place: new Map([['x', [group, 0]]])};
}
const sampled = (count, of) => Array.from({length: count}, (_, i) => of(i * 1e-3));
const close = (actual, expected, part) =>
    assert.ok(Math.abs(actual - expected) <= part * expected, `${actual} is not ${expected}`);

test('a sine has its frequency and amplitude wherever it lies between two lines', () => {
    for (const frequency of [50, 50.3, 50.8, 51.2, 123.4]) {
        const all = sampled(1024, t => 7 + 2 * Math.sin(2 * Math.PI * frequency * t));
        const {peak, step} = spectrum(store(all), 'x', 0, 2);
        close(peak.frequency, frequency, .002);
        close(peak.amplitude, 2, .02);
        close(step, 1000 / 1024, 1e-9);
    }
});

test('the lines of a sum are those of its parts', () => {
    const all =
        sampled(2048, t => Math.sin(2 * Math.PI * 125 * t) + .1 * Math.sin(2 * Math.PI * 250 * t));
    const {amplitudes, step} = spectrum(store(all), 'x', 0, 3);
    close(amplitudes[Math.round(125 / step)], 1, .01);
    close(amplitudes[Math.round(250 / step)], .1, .01);
    assert.ok(amplitudes[Math.round(190 / step)] < 1e-6);
});

test('the newest power of 2 of the samples between two times is used', () => {
    const all = sampled(3000, t => t < 1.9 ? 0 : Math.sin(2 * Math.PI * 100 * t));
    const found = spectrum(store(all), 'x', 1.9, 2.5);
    assert.equal(found.amplitudes.length, 256);
    close(found.peak.frequency, 100, .002);
});

test('few samples, unknown channels and values that are not finite have none', () => {
    assert.equal(spectrum(store(sampled(15, t => t)), 'x', 0, 1), null);
    assert.equal(spectrum(store(sampled(64, t => t)), 'y', 0, 1), null);
    assert.equal(spectrum(store(sampled(64, t => t === 0 ? NaN : t)), 'x', 0, 1), null);
    assert.equal(spectrum(store(sampled(64, () => 3)), 'x', 0, 1).peak, null);
});
