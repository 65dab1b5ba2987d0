// SPDX-License-Identifier: MIT
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {
    boxOf,
    build,
    firstBoxes,
    head,
    line,
    listHead,
    listLine,
    neighbourhood,
    groupId,
    groupName,
    unlinked
} from '../../tools/panel/page/graph_model.js';

const widthOf = text => 6 * text.length;
const plain = {
    groups: new Map(),
    open: new Set(),
    collapsed: new Set()
};

/// A chain of instances: a.0.out -> a.1.in, a.1.out -> a.2.in …
function chain(count) {
    const all = new Map();
    const pin = (instance, short, dir, signal) => {
        const name = `${instance}.${short}`;
        all.set(name, {kind: 'pin', name, instance, component: 'a', dir, signal, thread: 't'});
        return name;
    };
    for (let i = 0; i + 1 < count; i++) {
        const name = `s${i}`, writer = pin(`a.${i}`, 'out', 'OUT', name),
              reader = pin(`a.${i + 1}`, 'in', 'IN', name);
        all.set(name, {kind: 'sig', name, writer, pins: [writer, reader]});
    }
    return all;
}

test('each instance is a box, each reader an edge', () => {
    const {boxes, edges} = build(chain(3), plain, widthOf);
    assert.deepEqual(boxes.map(one => one.id), ['a.0', 'a.1', 'a.2']);
    assert.deepEqual(edges.map(({from, to}) => [from, to]), [['a.0', 'a.1'], ['a.1', 'a.2']]);
    assert.deepEqual([...boxes[1].threads], ['t']);
    assert.deepEqual([...boxes[1].ports.values()].map(port => port.label), ['in', 'out']);
    assert.equal(boxes[1].height, head + line + 4);
    assert.equal(edges[0].out, head + line / 2);
});

test('on a narrow screen ports are below each other, and links of two boxes are one edge', () => {
    const all = chain(3);
    all.set('a.0.next', {...all.get('a.0.out'), name: 'a.0.next', signal: 'more'});
    all.set('a.1.more', {...all.get('a.1.in'), name: 'a.1.more', signal: 'more'});
    all.set(
        'more', {kind: 'sig', name: 'more', writer: 'a.0.next', pins: ['a.0.next', 'a.1.more']});
    const how = {...plain, collapsed: new Set(['a.0', 'a.2']), isList: true};
    const {boxes, edges} = build(all, how, widthOf);
    assert.deepEqual(edges.map(({from, to, signals}) => [from, to, signals.length]), [
        ['a.0', 'a.1', 2],
        ['a.1', 'a.2', 1],
    ]);
    assert.deepEqual(boxes.map(one => one.height), [
        listHead,
        listHead + 3 * listLine + 4,
        listHead
    ]);
    assert.deepEqual([...boxes[1].ports.values()].map(({label, input}) => [label, input]), [
        ['in', true],
        ['more', true],
        ['out', false],
    ]);
    assert.deepEqual(
        [...boxes[1].ports.values()].map(port => port.y),
        [.5, 1.5, 2.5].map(at => listHead + at * listLine));
});

test('a folded group is a box, and its links are bundled', () => {
    const all = chain(5);
    all.set('a.0.next', {...all.get('a.0.out'), name: 'a.0.next', signal: 'more'});
    all.set('a.3.more', {...all.get('a.3.in'), name: 'a.3.more', signal: 'more'});
    all.set(
        'more',
        {kind: 'sig', name: 'more', writer: 'a.0.next', pins: ['a.0.next', 'a.3.more']});
    const groups = new Map([['a.0', 'left'], ['a.1', 'left'], ['a.2', 'left'], ['a.3', 'right']]);
    const {boxes, edges, frames} = build(all, {...plain, groups}, widthOf);
    assert.deepEqual(boxes.map(one => one.id), ['group:left', 'group:right', 'a.4']);
    assert.deepEqual([...boxes[0].members], ['a.0', 'a.1', 'a.2']);
    assert.deepEqual(
        edges.map(({from, to, signals}) => [from, to, signals.map(one => one.name)]),
        [['group:left', 'group:right', ['s2', 'more']], ['group:right', 'a.4', ['s3']]]);
    assert.deepEqual(frames, []);
    assert.equal(boxOf({boxes, edges, frames}, 'a.1.in').id, 'group:left');
});

test('an open group has its boxes in a frame', () => {
    const groups = new Map([['a.0', 'left'], ['a.1', 'left'], ['a.2', 'right']]);
    const {boxes, edges, frames} =
        build(chain(3), {...plain, groups, open: new Set(['left'])}, widthOf);
    assert.deepEqual(boxes.map(({id, group}) => [id, group]),
        [['a.0', 'left'], ['a.1', 'left'], ['group:right', '']]);
    assert.deepEqual(frames.map(one => one.title), ['left']);
    assert.deepEqual(edges.map(one => one.bundle), [false, true]);
});

test('the id of a group is of no instance', () => {
    assert.equal(groupName(groupId('axis.0')), 'axis.0');
    assert.equal(groupName('axis.0'), '');
});

test('instances without a linked pin are counted', () => {
    const all = chain(2);
    all.set('b.in', {kind: 'pin', name: 'b.in', instance: 'b', dir: 'IN'});
    all.set('a.0.in', {kind: 'pin', name: 'a.0.in', instance: 'a.0', dir: 'IN'});
    all.set('c.time', {kind: 'pin', name: 'c.time', component: 'c', dir: 'OUT'});
    assert.deepEqual(unlinked(all.values()), ['b']);
});

test('a collapsed box has its ports at its middle', () => {
    const {boxes, edges} = build(chain(2), {...plain, collapsed: new Set(['a.0'])}, widthOf);
    assert.equal(boxes[0].height, head);
    assert.equal(edges[0].out, head / 2);
});

test('a signal without a writer has no edge; an I/O pin writes', () => {
    const all = new Map([
        ['a.x', {kind: 'pin', name: 'a.x', instance: 'a', dir: 'IN'}],
        ['b.x', {kind: 'pin', name: 'b.x', instance: 'b', dir: 'IN'}],
        ['s', {kind: 'sig', name: 's', pins: ['a.x', 'b.x']}]
    ]);
    assert.equal(build(all, plain, widthOf).edges.length, 0);
    all.get('b.x').dir = 'I/O';
    const {edges} = build(all, plain, widthOf);
    assert.deepEqual(edges.map(({from, to}) => [from, to]), [['b', 'a']]);
});

test('the box of an instance, a pin and a signal', () => {
    const graph = build(chain(3), plain, widthOf);
    assert.equal(boxOf(graph, 'a.1').id, 'a.1');
    assert.equal(boxOf(graph, 'a.2.in').id, 'a.2');
    assert.equal(boxOf(graph, 's0').id, 'a.0');
    assert.equal(boxOf(graph, 'other'), undefined);
});

test('the neighbourhood has the boxes within that many edges', () => {
    const graph = build(chain(5), plain, widthOf);
    const near = depth => neighbourhood(graph, 'a.2', depth).boxes.map(one => one.id);
    assert.deepEqual(near(0), ['a.2']);
    assert.deepEqual(near(1), ['a.1', 'a.2', 'a.3']);
    assert.equal(neighbourhood(graph, 'a.2', 1).edges.length, 2);
    assert.equal(near(9).length, 5);
    assert.equal(neighbourhood(graph, 'other', 1), graph);
});

test('only the first boxes are kept', () => {
    const graph = build(chain(5), plain, widthOf);
    assert.equal(firstBoxes(graph, 5), graph);
    const part = firstBoxes(graph, 2);
    assert.deepEqual(part.boxes.map(one => one.id), ['a.0', 'a.1']);
    assert.equal(part.edges.length, 1);
});
