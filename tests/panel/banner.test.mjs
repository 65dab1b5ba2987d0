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
    assert.match(pauseOf({...good, running: false}), /hal shell start$/);
});
