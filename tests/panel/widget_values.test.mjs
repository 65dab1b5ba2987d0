// SPDX-License-Identifier: MIT
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {follow, formatted, nice} from '../../tools/panel/page/widget_values.js';

test("numbers by Python's formats", () => {
    const cases = [
        [3.14159, '2.1f', '3.1'], [3.9, 'd', '3'], [-3.9, 'd', '-3'], [255, 'x', 'ff'],
        [255, 'X', 'FF'], [8, 'o', '10'], [12345, '.2e', '1.23e+04'], [12345, '.2E', '1.23E+04'],
        [0.5, '+.1f', '+0.5'], [7, '03d', '007'], [1234.5678, '.3g', '1230'], [2, '', '2.000000']
    ];
    for (const [value, format, expected] of cases)
        assert.equal(formatted(value, format), expected, `${value} as ${format}`);
});

test('steps of 1, 2, 5', () => {
    for (const [size, expected] of [[1, 1], [1.1, 2], [2.5, 5], [5.1, 10], [0.03, 0.05], [300, 500]])
        assert.ok(Math.abs(nice(size) / expected - 1) < 1e-9, `${size}`);
});

test('a node follows its pin, or a name of the machine until that has a value', () => {
    const bound = [], sources = [], seen = [];
    const pins = {
        bind: (name, act) => bound.push([name, act]),
        source: (name, act) => sources.push([name, act])
    };
    follow({pin: 'p'}, pins, value => seen.push(value));
    follow({of : 'm'}, pins, value => seen.push(value));
    assert.deepEqual([bound[0][0], sources[0][0]], ['p', 'm']);
    sources[0][1](null);
    sources[0][1](4);
    assert.deepEqual(seen, [4]);
});
