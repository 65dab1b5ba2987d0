// SPDX-License-Identifier: MIT
import assert from 'node:assert/strict';
import test from 'node:test';

import {Moves, percent, timeText} from '../../tools/panel/page/timeline_moves.js';

test('Of_several_times_the_newest_is_sent', () => {
    const moves = new Moves();
    moves.add(['goto', '1ns']);
    moves.add(['goto', '2ns']);
    assert.deepEqual(moves.next(), ['goto', '2ns']);
    assert.equal(moves.next(), null);
});

test('Steps_add_up_and_follow_a_time', () => {
    const moves = new Moves();
    moves.addSteps(1, '');
    moves.add(['goto', '5ns']);
    moves.addSteps(1, '');
    moves.addSteps(1, '');
    moves.addSteps(-5, '');
    assert.deepEqual(moves.next(), ['goto', '5ns']);
    assert.deepEqual(moves.next(), ['step', 'back', '3']);
    assert.equal(moves.next(), null);
});

test('Steps_of_another_thread_begin_anew', () => {
    const moves = new Moves();
    moves.addSteps(4, 'fast');
    moves.addSteps(1, 'slow');
    assert.deepEqual(moves.next(), ['step', '1', 'slow']);
    moves.addSteps(2, 'slow');
    moves.addSteps(-2, 'slow');
    assert.equal(moves.next(), null);
});

test('A_time_is_shown_within_the_journal', () => {
    assert.equal(percent(5, 20), 25);
    assert.equal(percent(-1, 20), 0);
    assert.equal(percent(30, 20), 100);
    assert.equal(percent(0, 0), 0);
    assert.equal(timeText(1234567890), '1.234568 s');
});
