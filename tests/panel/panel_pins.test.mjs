// SPDX-License-Identifier: MIT
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {Pins} from '../../tools/panel/page/panel_pins.js';

/// Pins of a panel with two outputs, and what they sent.
function made(mayWrite = () => true) {
    const sent = [];
    const outputs = {a: {value: false}, b: {value: 1, unit: 'mm'}};
    const pins = new Pins(outputs, values => sent.push(values), mayWrite);
    return {pins, sent};
}

test('a bound function gets the value now and at each change', () => {
    const {pins} = made(), seen = [];
    pins.bind('b', value => seen.push(value));
    pins.set('b', 2);
    pins.set('a', true);
    pins.bind('', () => seen.push('never'));
    assert.deepEqual(seen, [1, 2]);
});

test('what is written before the next microtask is one message', async () => {
    const {pins, sent} = made();
    pins.write({a: true});
    pins.write({b: 5});
    pins.write({a: false});
    assert.deepEqual(sent, []);
    await Promise.resolve();
    assert.deepEqual(sent, [{a: false, b: 5}]);
    pins.write({b: 6});
    await Promise.resolve();
    assert.deepEqual(sent[1], {b: 6});
});

test('the unit of a pin', () => {
    const {pins} = made();
    assert.deepEqual([pins.unit('b'), pins.unit('a'), pins.unit('c')], ['mm', '', '']);
});

test('without control nothing is written', async () => {
    const {pins, sent} = made(() => false);
    pins.write({b: 5});
    await Promise.resolve();
    assert.deepEqual(sent, []);
    assert.equal(pins.value('b'), 1);
});

test('buttons are released after a write, too', async () => {
    const {pins} = made();
    let released = 0, ended = 0;
    pins.release.push(() => released++);
    pins.ends.push(() => ended++);
    pins.ready = true;
    pins.write({a: true});
    await Promise.resolve();
    pins.releaseAll();
    pins.ends.forEach(end => end());
    assert.deepEqual([released, ended, pins.ready], [1, 1, true]);
});
