// SPDX-License-Identifier: MIT
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {measure, Store} from '../../tools/panel/page/scope_data.js';

const rate = 10000, seconds = 60;  // more rows than the ring of 2^18 has

/// A minute at 10 kHz: the value is the second, with one spike of 99 at 3.5 s. `length`: of the
/// layout.
function minute(rows = 1000, length = 0) {
    const store = new Store(), words = 3;
    store.layout([{columns: [0], thread: 'fast', period_ns: 1e5}], ['v'], [], length);
    for (let batch = 0; batch < rate * seconds / rows; batch++) {
        const bytes = new ArrayBuffer(rows * words * 8), view = new DataView(bytes);
        for (let row = 0; row < rows; row++) {
            const cycle = batch * rows + row;
            view.setBigUint64(row * words * 8, BigInt(cycle), true);
            view.setBigInt64(row * words * 8 + 8, BigInt(cycle) * 100000n, true);
            const value = cycle === 3.5 * rate ? 99 : Math.floor(cycle / rate);
            view.setFloat64(row * words * 8 + 16, value, true);
        }
        store.samples(
            {parts: [{group: 0, rows, lost: 0}], until_ns: (batch + 1) * rows * 1e5}, bytes,
            {columns: [{type: 'float'}]});
    }
    return store;
}

test('minima and maxima remain of rows that are overwritten, with every spike', () => {
    const store = minute();
    assert.equal(store.gaps, 0);
    assert.equal(store.oldest, 0);
    assert.ok(store.isCoarse('v', 3) && !store.isCoarse('v', 50));
    const {min, max, mean, rms} = measure(store, 'v', 3.1, 3.9);
    assert.deepEqual([min, max, mean, rms], [3, 99, null, null]);
    assert.deepEqual(store.history('v').extremes(10.1, 10.9), [10, 10]);
    assert.equal(measure(store, 'v', 50.1, 50.9).mean, 50);
});

test('they remain of a batch that has more rows than are kept, at the length of a recording', () => {
    const store = minute(rate * seconds), coarse = minute(rate * seconds, 6000);
    assert.deepEqual(store.history('v').extremes(3.1, 3.9), [3, 99]);
    assert.deepEqual(coarse.history('v').extremes(3.1, 3.9), [3, 99]);
    assert.equal(store.oldest, 0);
    assert.ok(coarse.pastWidth > .09 && store.pastWidth === .01);
});

test('there is no history before the first row, and none after the newest', () => {
    const store = minute();
    assert.equal(store.history('v').extremes(-2, -1), null);
    assert.equal(store.history('v').extremes(61, 62), null);
});
