// SPDX-License-Identifier: MIT
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {measure, Store, Trigger, valueAt} from '../../tools/panel/page/scope_data.js';

/// A store with one channel of floats, `value(i)` at `i` ms.
function recorded(count, value) {
    const store = new Store();
    store.layout([{columns: [0]}], ['out']);
    for (let i = 0; i < count; i++)
        store.values({time_ns: i * 1e6, values: [value(i)], skipped: 0});
    return store;
}

/// The bytes of a batch: cycle, time in ns, a float per row.
function batch(rows) {
    const bytes = new ArrayBuffer(rows.length * 24), view = new DataView(bytes);
    rows.forEach(([cycle, ns, value], row) => {
        view.setBigUint64(row * 24, BigInt(cycle), true);
        view.setBigInt64(row * 24 + 8, BigInt(ns), true);
        view.setFloat64(row * 24 + 16, value, true);
    });
    return bytes;
}

test('a sine of 10 Hz is measured as one', () => {
    const store = recorded(1000, i => 2 + 3 * Math.sin(2 * Math.PI * 10 * i / 1000));
    const {min, max, mean, rms, deviation, frequency} = measure(store, 'out', 0, 1);
    assert.ok(Math.abs(min + 1) < 1e-2 && Math.abs(max - 5) < 1e-2);
    assert.ok(Math.abs(mean - 2) < 1e-2);
    assert.ok(Math.abs(rms - Math.sqrt(4 + 4.5)) < 1e-2);
    assert.ok(Math.abs(deviation - 3 / Math.SQRT2) < 1e-3);
    assert.ok(Math.abs(frequency - 10) < 1e-6);
});

test('the deviation of a small signal on a large mean is exact', () => {
    const {deviation} = measure(recorded(1000, i => 1e9 + i % 2), 'out', 0, 1);
    assert.ok(Math.abs(deviation - .5) < 1e-6, String(deviation));
});

test('nothing is measured without samples, and no frequency of a constant', () => {
    assert.equal(measure(recorded(0, () => 0), 'out', 0, 1), null);
    assert.equal(measure(recorded(10, () => 0), 'gone', 0, 1), null);
    assert.equal(measure(recorded(10, () => 7), 'out', 0, 1).frequency, null);
    assert.equal(measure(recorded(10, () => NaN), 'out', 0, 1), null);
});

test('the value at a time is that of the last row not after it', () => {
    const store = recorded(10, i => i);
    assert.equal(valueAt(store, 'out', 0.0045), 4);
    assert.equal(valueAt(store, 'out', 0.005), 5);
    assert.equal(valueAt(store, 'out', -1), null);
});

test('a trigger fires once per edge, at the interpolated time', () => {
    const store = recorded(100, i => (i % 20 < 10 ? 0 : 1));
    const rising = new Trigger('out', 'rising', 0.5).scan(store);
    assert.deepEqual(rising.map(t => Math.round(t * 1e4)), [95, 295, 495, 695, 895]);
    const either = new Trigger('out', 'either', 0.5).scan(store);
    assert.equal(either.length, 9);
});

test('a trigger that was scanned goes on with the rows that came since', () => {
    const store = recorded(15, i => (i < 10 ? 0 : 1)), trigger = new Trigger('out', 'rising', 0.5);
    assert.equal(trigger.scan(store).length, 1);
    assert.equal(trigger.scan(store).length, 0);
});

test('a batch with a missing cycle counts a gap', () => {
    const store = new Store();
    store.layout([{columns: [0]}], ['out']);
    const event = {parts: [{group: 0, rows: 3, lost: 2}], until_ns: 3e6};
    const layout = {columns: [{type: 'float'}]};
    store.samples(event, batch([[1, 1e6, 0.5], [2, 2e6, 1.5], [4, 3e6, 2.5]]), layout);
    assert.equal(store.gaps, 1);
    assert.equal(store.lost, 2);
    assert.equal(valueAt(store, 'out', 1), 2.5);
});

test('columns of pixels keep the extremes', () => {
    const store = recorded(1000, i => (i === 500 ? 100 : i % 2));
    const columns = store.columns('out', 0.1);
    const at = 5 & columns.mask;
    assert.equal(columns.high[at], 100);
    assert.equal(columns.low[at], 0);
});
