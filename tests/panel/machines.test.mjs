// SPDX-License-Identifier: MIT
import assert from 'node:assert/strict';
import test from 'node:test';

import {addressOf, chosenIn, menuOf, textOf} from '../../tools/panel/page/machines.js';

const left = {name: 'left', files: ['cells/left.hal'], pid: 4711, state: 'running'};
const right = {name: 'right', files: ['right.hal', 'io.hal'], pid: 12, state: 'stopped'};

test('A_machine_is_named_with_its_netlist_process_and_state', () => {
    assert.equal(textOf(left), 'left: left.hal, process 4711, running');
    assert.equal(textOf(right), 'right: right.hal io.hal, process 12, stopped');
    assert.equal(textOf({...left, state: 'ended'}), 'left: left.hal, process 4711, ended');
    assert.equal(
        textOf({...left, state: 'silent'}), 'left: left.hal, process 4711, not responding');
});

test('What_is_unknown_of_a_machine_is_left_out', () => {
    assert.equal(textOf({name: 'x', files: [], pid: 0, state: 'absent'}), 'x: not running');
});

test('One_machine_has_no_menu', () => {
    assert.deepEqual(menuOf([left], 'left'), []);
    assert.deepEqual(menuOf([], 'left'), []);
    assert.deepEqual(menuOf([left], ''), []);
});

test('The_menu_marks_the_machine_that_is_shown', () => {
    assert.deepEqual(menuOf([left, right], 'right').map(({name, isShown}) => [name, isShown]), [
        ['left', false],
        ['right', true],
    ]);
});

test('The_shown_machine_is_in_the_menu_also_when_hal_panel_does_not_know_it', () => {
    const rows = menuOf([left], 'mill');
    assert.deepEqual(rows.map(({text}) => text), [textOf(left), 'mill: not running']);
    assert.ok(rows[1].isShown);
});

test('The_address_keeps_the_view_and_names_another_machine', () => {
    const place = {pathname: '/', hash: '#/scope?ch=sine'};
    assert.equal(addressOf(place, 'right', 'left'), '/?machine=right#/scope?ch=sine');
    assert.equal(addressOf(place, 'left', 'left'), '/#/scope?ch=sine');
    assert.equal(chosenIn('?machine=right'), 'right');
    assert.equal(chosenIn(''), '');
});
