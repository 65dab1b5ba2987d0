// SPDX-License-Identifier: MIT
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {compareNames, similar} from '../../tools/panel/page/names.js';

test('digits are compared as numbers, as in tests/unit/text_natural_order.cpp', () => {
    const names = [
        'axis10.x', 'axis2.x', 'axis.x', 'axis2', 'joint.10.pos', 'joint.9', 'axis02.x', 'axis1',
        'Axis3', ''
    ];
    assert.deepEqual(names.sort(compareNames), [
        '', 'Axis3', 'axis.x', 'axis1', 'axis2', 'axis02.x', 'axis2.x', 'axis10.x', 'joint.9',
        'joint.10.pos'
    ]);
    assert.ok(compareNames('a99999999999999999999', 'a100000000000000000000') < 0);
    assert.ok(compareNames('a00', 'a1') < 0);
    assert.equal(compareNames('a1', 'a1'), 0);
    assert.ok(compareNames('a01', 'a1') < 0 && compareNames('a1', 'a01') > 0);
});

test('the order is total', () => {
    const names = [];
    for (let i = 0; i < 6 ** 3; i++)
        names.push([...i.toString(6)].map(digit => '01a.9b'[Number(digit)]).join(''));
    const sorted = [...names].sort(compareNames);
    for (let i = 0; i + 1 < sorted.length; i++)
        for (let k = i + 1; k < sorted.length; k++)
            assert.ok(
                sorted[i] === sorted[k] || compareNames(sorted[i], sorted[k]) < 0,
                `${sorted[i]} ${sorted[k]}`);
});

test('what was probably meant is found, best first', () => {
    const all = ['pendulum-angle', 'pendulum-speed', 'arm-angle', 'adder.in0', 'adder.in1', 'x'];
    assert.deepEqual(similar('pendulum-angel', all), ['pendulum-angle', 'pendulum-speed']);
    assert.deepEqual(similar('adder_in1', all), ['adder.in1', 'adder.in0']);
    assert.deepEqual(similar('ARM-ANGLE', all)[0], 'arm-angle');
    assert.deepEqual(similar('speed', all), ['pendulum-speed']);
    assert.deepEqual(similar('zzzzzz', all), []);
    assert.deepEqual(similar('', all), []);
    assert.equal(similar('adder.in', all, 1).length, 1);
});
