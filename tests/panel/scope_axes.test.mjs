// SPDX-License-Identifier: MIT
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {channelTitle, isStack, valueLabels} from '../../tools/panel/page/scope_axes.js';

test('lines have the numbers of a channel among few others', () => {
    const channel = {name: 'speed', unit: 'mm/s', scale: .5, position: 1}, few = [channel];
    assert.ok(!isStack(few));
    assert.equal(channelTitle(channel, few), 'speed (mm/s)');
    const texts = valueLabels(channel, 4).map(({text}) => text);
    assert.deepEqual(texts, ['0', '-0.5', '-1']);
});

test('one of many channels says what a division is', () => {
    const channel = {name: 'speed', unit: '', scale: .5, position: 1};
    const many = Array.from({length: 16}, () => channel);
    assert.ok(isStack(many));
    assert.equal(channelTitle(channel, many), 'speed, 0.5 per division');
});
