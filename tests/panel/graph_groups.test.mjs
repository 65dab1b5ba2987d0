// SPDX-License-Identifier: MIT
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {groupsOf, instancesOf} from '../../tools/panel/page/graph_groups.js';

/// Instances as 'name component', all in x.hal and servo unless a third and fourth word say more.
function instances(...lines) {
    return new Map(lines.map(words => {
        const [name, component, file = '/home/me/x.hal', thread = 'servo'] = words.split(' ');
        return [name, {name, component, file, thread}];
    }));
}
const groups = (grouping, ...lines) => Object.fromEntries(groupsOf(instances(...lines), grouping));

test('names group by the longest beginning that two components share', () => {
    const found = groups(
        'name', 'axis.0.pid pid', 'axis.0.limit limit3', 'axis.1.pid pid', 'axis.1.limit limit3',
        'x-scale scale', 'x-pid pid');
    assert.deepEqual(found, {
        'axis.0.pid': 'axis.0',
        'axis.0.limit': 'axis.0',
        'axis.1.pid': 'axis.1',
        'axis.1.limit': 'axis.1',
        'x-scale': 'x',
        'x-pid': 'x'
    });
});

test('names group by the last word when the component is first', () => {
    assert.deepEqual(
        groups('name', 'pid.x pid', 'scale.x scale', 'pid.y pid', 'scale.y scale'),
        {'pid.x': 'x', 'scale.x': 'x', 'pid.y': 'y', 'scale.y': 'y'});
});

test('numbered instances group by their component; one alone has no group', () => {
    assert.deepEqual(
        groups('name', 'and2.0 and2', 'and2.1 and2', 'pid.0 pid', 'estop estop-latch'),
        {'and2.0': 'and2', 'and2.1': 'and2'});
});

test('component, file and thread group', () => {
    const lines = ['a pid', 'b pid /x/motors.hal', 'c sum2 /x/motors.hal fast', 'd sum2'];
    assert.deepEqual(groups('component', ...lines), {a: 'pid', b: 'pid', c: 'sum2', d: 'sum2'});
    assert.deepEqual(
        groups('file', ...lines), {a: 'x.hal', d: 'x.hal', b: 'motors.hal', c: 'motors.hal'});
    assert.deepEqual(groups('thread', ...lines), {a: 'servo', b: 'servo', d: 'servo'});
    assert.deepEqual(groups('none', ...lines), {});
});

test('files with the same name are different groups, titled with their folders', () => {
    const all = (...files) =>
        files.flatMap((file, i) => [`a${i} pid ${file}`, `b${i} pid ${file}`]);
    const titles = (...files) => [...new Set(Object.values(groups('file', ...all(...files))))];
    assert.deepEqual(
        titles('/m/x/motors.hal', '/m/y/motors.hal', '/m/y/io.hal'),
        ['x/motors.hal', 'y/motors.hal', 'io.hal']);
    assert.deepEqual(
        titles('/m/x/a/motors.hal', '/m/y/a/motors.hal', 'motors.hal', '/m/oldmotors.hal'),
        ['x/a/motors.hal', 'y/a/motors.hal', 'motors.hal', 'oldmotors.hal']);
    assert.deepEqual(titles('/motors.hal', '/x/motors.hal'), ['/motors.hal', 'x/motors.hal']);
    assert.deepEqual(groups('file', 'a pid /x/m.hal', 'b pid /y/m.hal'), {});
});

test('an instance is found by its pins, its thread by any of them', () => {
    const pin = (name, more) => ({kind: 'pin', name, instance: 'a.0', component: 'a', ...more});
    const [[name, one]] =
        instancesOf([pin('a.0.x', {}), pin('a.0.y', {thread: 't'}), {kind: 'sig', name: 's'}]);
    assert.deepEqual([name, one.component, one.thread], ['a.0', 'a', 't']);
});
