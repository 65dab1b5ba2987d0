// SPDX-License-Identifier: MIT
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {clustered} from '../../tools/panel/page/graph_clusters.js';

const box = (id, group = '') => ({id, group, width: 100, height: 40});
const edge = (from, to) => ({from, to, out: 20, in : 20});

function overlaps(a, b) {
    return a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height &&
        b.y < a.y + a.height;
}
const within = (inner, outer) => inner.x >= outer.x && inner.y >= outer.y &&
    inner.x + inner.width <= outer.x + outer.width &&
    inner.y + inner.height <= outer.y + outer.height;

test('the boxes of a group are in its frame, and all others are outside', () => {
    const boxes = [box('a', 'x'), box('b', 'x'), box('c', 'y'), box('d', 'y'), box('e')];
    const edges = [edge('a', 'b'), edge('b', 'c'), edge('c', 'd'), edge('d', 'e'), edge('e', 'a')];
    const frames = [{id: 'group:x', title: 'x'}, {id: 'group:y', title: 'y'}];
    const size = clustered({boxes, edges, frames});
    for (const frame of frames)
        for (const one of boxes)
            assert.equal(one.group === frame.title ? within(one, frame) : !overlaps(one, frame), true);
    assert.ok(!overlaps(frames[0], frames[1]));
    for (const frame of frames)
        assert.ok(within(frame, {x: 0, y: 0, ...size}));
});

test('every edge runs from the right of its port to the left of the other', () => {
    const boxes = [box('a', 'x'), box('b', 'x'), box('c')];
    const edges = [edge('a', 'b'), edge('b', 'c'), edge('c', 'a')];
    clustered({boxes, edges, frames: [{id: 'group:x', title: 'x'}]});
    const of = id => boxes.find(one => one.id === id);
    for (const {from, to, path} of edges) {
        assert.deepEqual(path[0], [of(from).x + 100, of(from).y + 20]);
        assert.deepEqual(path[path.length - 1], [of(to).x, of(to).y + 20]);
    }
});

test('without frames it is the layered layout', () => {
    const boxes = [box('a'), box('b')];
    assert.ok(clustered({boxes, edges: [edge('a', 'b')], frames: []}).width > 200);
    assert.ok(boxes[1].x > boxes[0].x + 100);
});
