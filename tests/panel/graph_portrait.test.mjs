// SPDX-License-Identifier: MIT
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {portrait} from '../../tools/panel/page/graph_portrait.js';

const screen = 380;
const box = (id, group = '') => ({id, group, width: 100, height: 32});
const edge = (from, to) => ({from, to, out: 20, in : 20});

function overlaps(a, b) {
    return a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height &&
        b.y < a.y + a.height;
}
const within = (inner, outer) => inner.x >= outer.x - 1e-6 && inner.y >= outer.y - 1e-6 &&
    inner.x + inner.width <= outer.x + outer.width + 1e-6 &&
    inner.y + inner.height <= outer.y + outer.height + 1e-6;

test('a chain runs from top to bottom, each box below the one before', () => {
    const boxes = ['a', 'b', 'c'].map(id => box(id));
    portrait({boxes, edges: [edge('a', 'b'), edge('b', 'c')], frames: []}, screen);
    assert.ok(boxes[0].y + 32 < boxes[1].y);
    assert.ok(boxes[1].y + 32 < boxes[2].y);
    assert.deepEqual(boxes.map(one => one.x), [140, 140, 140]);
});

test('boxes of one rank that are wider than the screen are in several rows', () => {
    const boxes = Array.from({length: 9}, (_, i) => box(`n${i}`));
    const edges = boxes.slice(1).map(({id}) => edge('n0', id));
    const {width, height} = portrait({boxes, edges, frames: []}, screen);
    assert.equal(width, screen);
    assert.ok(height > 4 * 32);
    assert.equal(new Set(boxes.map(one => one.y)).size, 1 + 3);
});

test('an edge begins at the bottom of its box and ends at the top of the other', () => {
    const boxes = ['a', 'b', 'c'].map(id => box(id)),
          edges = [edge('a', 'b'), edge('b', 'c'), edge('a', 'c')];
    portrait({boxes, edges, frames: []}, screen);
    const of = id => boxes.find(one => one.id === id);
    for (const {from, to, path, back, vertical} of edges) {
        assert.ok(vertical && !back);
        assert.equal(path[0][1], of(from).y + 32);
        assert.equal(path[path.length - 1][1], of(to).y);
    }
    const passing = edges[2].path.filter(([, y]) => y >= of('b').y && y <= of('b').y + 32);
    assert.equal(passing.length, 2);
    for (const [x] of passing)
        assert.ok(x < of('b').x || x > of('b').x + 100, 'it passes beside b');
});

test('an edge that closes a circle runs back, from a top to a bottom', () => {
    const boxes = ['a', 'b'].map(id => box(id)), edges = [edge('a', 'b'), edge('b', 'a')];
    portrait({boxes, edges, frames: []}, screen);
    const [back] = edges.filter(one => one.back), of = id => boxes.find(one => one.id === id);
    assert.equal(back.path[0][1], of(back.from).y);
    assert.equal(back.path[back.path.length - 1][1], of(back.to).y + 32);
});

test('an edge to its own box is not drawn', () => {
    const graph = {boxes: [box('a')], edges: [edge('a', 'a')], frames: []};
    portrait(graph, screen);
    assert.deepEqual(graph.edges, []);
});

test('no boxes are an empty picture', () => {
    assert.deepEqual(portrait({boxes: [], edges: [], frames: []}, screen), {width: 380, height: 1});
});

test('random graphs: nothing overlaps, all are within the screen, groups within frames', () => {
    let seed = 1;
    const random = limit => {
        seed = (seed * 48271) % 2147483647;
        return seed % limit;
    };
    for (let round = 0; round < 40; round++) {
        const groups = ['', 'x', 'y'].slice(0, 1 + round % 3);
        const boxes = Array.from(
            {length: 3 + random(30)}, (_, i) => box(`n${i}`, groups[i % groups.length]));
        const edges = Array.from(
            {length: random(60)},
            () => edge(`n${random(boxes.length)}`, `n${random(boxes.length)}`));
        const frames = groups.slice(1).map(title => ({id: `group:${title}`, title}));
        const graph = {boxes, edges, frames};
        const size = portrait(graph, screen);
        assert.ok(size.width <= screen);
        boxes.forEach((one, i) => {
            assert.ok(within(one, {x: 0, y: 0, ...size}));
            for (const other of boxes.slice(i + 1))
                assert.ok(!overlaps(one, other));
            for (const frame of frames)
                assert.ok(one.group === frame.title ? within(one, frame) : !overlaps(one, frame));
        });
        for (const {path} of graph.edges)
            for (const [x, y] of path)
                assert.ok(Number.isFinite(x) && Number.isFinite(y));
    }
});
