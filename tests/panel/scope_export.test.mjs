// SPDX-License-Identifier: MIT
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {label, timeLabels, valueLabels} from '../../tools/panel/page/scope_axes.js';
import {Store} from '../../tools/panel/page/scope_data.js';
import {csv, overwritten} from '../../tools/panel/page/scope_export.js';

/// Two threads, of 1 ms and 2 ms.
function twoThreads() {
    const store = new Store(), event = {until_ns: 0};
    store.layout(
        [
            {columns: [0], thread: 'fast', period_ns: 1e6},
            {columns: [1], thread: 'slow', period_ns: 2e6}
        ],
        ['a', 'b,"c"']);
    const row = (cycle, ns, value) => {
        const bytes = new ArrayBuffer(24), view = new DataView(bytes);
        view.setBigUint64(0, BigInt(cycle), true);
        view.setBigInt64(8, BigInt(ns), true);
        view.setFloat64(16, value, true);
        return bytes;
    };
    const layout = {columns: [{type: 'float'}, {type: 'float'}]};
    for (let i = 0; i < 6; i++) {
        event.until_ns = i * 1e6;
        event.parts = [{group: 0, rows: 1, lost: 0}];
        store.samples(event, row(i, i * 1e6, i / 3), layout);
        event.parts = [{group: 1, rows: 1, lost: 0}];
        if (i % 2 === 0) store.samples(event, row(i, i * 1e6 + 500, -i), layout);
    }
    return store;
}

test('the table has a row per sample of each thread, in the order of time', () => {
    const lines = csv(twoThreads(), ['a', 'b,"c"', 'unknown'], .002, .004).split('\n');
    assert.deepEqual(lines, [
        'time_s,a,"b,""c"""', '0.000000000,0.6666666666666666,', '0.000000500,,-2',
        '0.001000000,1,', '0.002000000,1.3333333333333333,', ''
    ]);
});

test('the table of nothing is its header', () => {
    assert.equal(csv(twoThreads(), ['a'], 5, 6), 'time_s,a\n');
    assert.equal(csv(new Store(), ['a'], 0, 1), 'time_s\n');
});

/// 'slow' has 1000 rows of 0.4 s. 'a' and 'b' have 400 000 rows of 1 ms, the newest 262 143 are
/// kept.
function longRecord() {
    const store = new Store();
    store.layout(
        [
            {columns: [0, 1], thread: 'fast', period_ns: 1e6},
            {columns: [2], thread: 'slow', period_ns: 4e8}
        ],
        ['a', 'b', 'slow']);
    const [fast, slow] = store.groups;
    for (let i = 0; i < 400000; i++)
        fast.add(i / 1000);
    for (let i = 0; i < 1000; i++)
        slow.add(i * .4);
    store.newest = 399.999;
    return store;
}

test('what a file lacks is reported, and none is saved of minima and maxima alone', () => {
    const store = longRecord();
    const of = (...all) => Object.values(overwritten(store, ...all));
    assert.deepEqual(of(['a', 'b', 'slow'], 200, 210), [false, '']);
    assert.deepEqual(of(['a', 'unknown'], 137, 147, ' of the picture'), [
        false,
        'the file has the last 9.143 s of the picture: ' +
            'only minima and maxima of earlier samples are kept'
    ]);
    assert.deepEqual(of(['a', 'b', 'slow'], 0, 399.999), [
        false,
        'the file has the last 262.1 s of a, b: only minima and maxima of earlier samples are kept'
    ]);
    assert.deepEqual(of(['slow', 'b'], 10, 20, ' of the picture'), [
        false, 'the file has no samples of b: only minima and maxima of earlier samples are kept'
    ]);
    assert.deepEqual(of(['a', 'b'], 10, 20, ' of the picture'), [
        true,
        'no file is saved: only minima and maxima of this time are kept; ' +
            'scroll to the last 262.1 s, whose samples are kept'
    ]);
});

test('the axis of a channel has its values, and 0 at the zero line', () => {
    assert.deepEqual(
        valueLabels({scale: 2, position: 0}, 8).map(one => one.text),
        ['6', '4', '2', '0', '-2', '-4', '-6']);
    assert.deepEqual(
        valueLabels({scale: .05, position: -1}, 8).map(one => one.text),
        ['0.2', '0.15', '0.1', '0.05', '0', '-0.05', '-0.1']);
    assert.equal(valueLabels({scale: 5, position: 3.75}, 8)[0].text, '-3.75');
    assert.equal(label(1234567, 1e5), '1.23e+6');
    assert.equal(label(-1e-12, .1), '0');
});

test('the axis of time has one unit, and 0 at the trigger or the newest sample', () => {
    const words = (...all) => timeLabels(...all).map(one => one.text);
    assert.deepEqual(words(.01, 10, 2), ['-10', '0', '10', '20', '30', '40', '50', '60', '70 ms']);
    assert.equal(words(.5, 10, 10)[8], '-0.5 s');
    assert.equal(words(1e-4, 10, 10)[8], '-100 µs');
    assert.deepEqual(words(.1, 10, 10, 3), ['-900', '-600', '-300 ms']);
});
