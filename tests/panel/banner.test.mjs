// SPDX-License-Identifier: MIT
import assert from 'node:assert/strict';
import test from 'node:test';

import {pauseOf, problemOf} from '../../tools/panel/page/banner.js';

const good = {
    server: 'up',
    machine: true,
    responding: true,
    running: true,
    instance: 'mill',
    hal: 'hal',
    past: null,
};

test('A_machine_that_runs_has_no_banner', () => {
    assert.equal(problemOf(good), '');
    assert.equal(pauseOf(good), '');
});

test('Before_the_first_answer_there_is_no_banner', () => {
    assert.equal(problemOf({...good, machine: null}), '');
    assert.equal(problemOf({...good, machine: null, server: 'connecting'}), '');
});

test('A_machine_that_is_down_is_named', () => {
    assert.match(problemOf({...good, machine: false}), /^Machine 'mill' is not running[.]/);
    assert.match(problemOf({...good, responding: false}), /does not respond/);
    assert.match(problemOf({...good, server: 'lost', reason: 'closed'}), /hal panel: closed[.]/);
});

test('A_stopped_machine_says_how_to_start_it', () => {
    const stopped = {...good, running: false};
    assert.match(pauseOf(stopped), /type: hal shell --name mill start$/);
    assert.match(pauseOf({...stopped, instance: 'default'}), /type: hal shell start$/);
});

test('Commands_are_named_as_hal_panel_was_started', () => {
    const clone = {...good, hal: './hal', instance: 'default'};
    assert.match(pauseOf({...clone, running: false}), /type: [.][/]hal shell start$/);
    assert.match(problemOf({...clone, machine: false}), /type: [.][/]hal run FILE[.]hal$/);
    assert.match(
        problemOf({...clone, machine: false, instance: 'mill'}),
        /type: [.][/]hal run --name mill FILE[.]hal$/);
});
