// SPDX-License-Identifier: MIT
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {
    boxOf,
    build,
    firstBoxes,
    head,
    line,
    neighbourhood
} from '../../tools/panel/page/graph_model.js';

const widthOf = text => 6 * text.length;
const plain = {
    grouped: false,
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

test('a group is a box per component', () => {
    const {boxes, edges} = build(chain(3), {grouped: true, collapsed: new Set()}, widthOf);
    assert.deepEqual(boxes.map(one => one.id), ['a']);
    assert.equal(edges.length, 2);
});

test('a collapsed box has its ports at its middle', () => {
    const {boxes, edges} = build(chain(2), {grouped: false, collapsed: new Set(['a.0'])}, widthOf);
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
