// SPDX-License-Identifier: MIT
import assert from 'node:assert/strict';
import test from 'node:test';

import {Moves, noteText, percent, timeText} from '../../tools/panel/page/timeline_moves.js';

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

test('The_note_counts_the_marks_that_are_not_shown', () => {
    assert.equal(noteText('', {left_out: 0}), '');
    assert.equal(noteText('', {left_out: 1}), '1 further mark is not shown');
    assert.equal(noteText('', {left_out: 120}), '120 further marks are not shown');
});

test('The_note_has_the_problem_first_and_what_the_journal_lacks_last', () => {
    const moment = {moving: true, time_ns: 5e8, state: ' the end\n', left_out: 2};
    assert.equal(
        noteText('no such thread', moment, ['the end is missing']),
        'no such thread; executing the journal: 0.500000 s; the end; ' +
            '2 further marks are not shown; the end is missing');
    assert.equal(noteText('', {state: 'interrupted'}), '');
    assert.equal(noteText('', null), '');
});

test('The_note_tells_how_long_going_back_takes_without_keyframes', () => {
    const how = 'without keyframes: going back executes the journal from its begin; the last move';
    assert.equal(noteText('', {copied: false, took_ms: 1234}), `${how} took 1.23 s`);
    assert.equal(noteText('', {copied: true, took_ms: 1234}), '');
    assert.equal(noteText('', {copied: false}), '');
});
