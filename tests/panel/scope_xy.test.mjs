// SPDX-License-Identifier: MIT
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {Store} from '../../tools/panel/page/scope_data.js';
import {axes, axis, pairs, ticks} from '../../tools/panel/page/scope_xy.js';

/// Two channels of one thread, or of two threads where that of y has every second row.
function circle(threads) {
    const store = new Store(), groups = threads === 1 ? [{columns: [0, 1]}] :
                                                        [{columns: [0]}, {columns: [1]}];
    store.layout(groups, ['x', 'y']);
    const [first, second = first] = store.groups;
    for (let i = 0; i < 100; i++) {
        const angle = 2 * Math.PI * i / 100, at = first.add(i / 1000);
        first.values[0][at] = 2 * Math.cos(angle);
        if (threads === 1) first.values[1][at] = 2 * Math.sin(angle);
        if (threads === 2 && i % 2 === 0)
            second.values[0][second.add(i / 1000 + 1e-4)] = 2 * Math.sin(angle);
    }
    return store;
}

test('a pair has the values of one cycle', () => {
    const all = pairs(circle(1), 'x', 'y', 0, 1, 1000);
    assert.equal(all.length, 100);
    assert.ok(all.every(([x, y]) => Math.abs(Math.hypot(x, y) - 2) < 1e-12));
});

test('channels of two threads are paired with the last value before', () => {
    const all = pairs(circle(2), 'x', 'y', 0, 1, 1000);
    assert.equal(all.length, 50);
    assert.ok(all.every(([x, y]) => Math.abs(Math.hypot(x, y) - 2) < 1e-12));
});

test('of too many rows every n-th is a pair; unknown and invalid values are none', () => {
    const store = circle(1);
    assert.equal(pairs(store, 'x', 'y', 0, 1, 30).length, 25);
    assert.deepEqual(pairs(store, 'x', 'z', 0, 1, 30), []);
    store.groups[0].values[0][0] = NaN;
    assert.equal(pairs(store, 'x', 'y', 0, 1, 1000).length, 99);
    assert.equal(pairs(store, 'x', 'y', .01, .0195, 1000).length, 10);
});

test('an axis has all values, also when there is only one', () => {
    const {low, high} = axis(-1, 3);
    assert.ok(low < -1 && high > 3);
    assert.deepEqual(ticks({low: -1.2, high: 2.3, step: 1}), [-1, 0, 1, 2]);
    const flat = axis(5, 5);
    assert.ok(flat.low < 5 && flat.high > 5 && ticks(flat).length > 2);
});

test('with one unit a circle is as wide as high', () => {
    const all = pairs(circle(1), 'x', 'y', 0, 1, 1000), {x, y} = axes(all, true, 300, 100);
    const perPixel = ({low, high}, pixels) => (high - low) / pixels;
    assert.ok(Math.abs(perPixel(x, 300) - perPixel(y, 100)) < 1e-9);
    assert.ok(y.low < -2 && y.high > 2);
    const free = axes(all, false, 300, 100);
    assert.ok(perPixel(free.x, 300) < perPixel(free.y, 100));
    assert.equal(axes([[0, 0], [1, 1000]], true, 300, 100).x.high, axis(0, 1).high);
});
