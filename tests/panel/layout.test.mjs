// SPDX-License-Identifier: MIT
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {layered} from '../../tools/panel/page/layout.js';

const box = id => ({id, width: 100, height: 40});
const edge = (from, to) => ({from, to, out: 20, in : 20});

function overlaps(a, b) {
    return a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height &&
        b.y < a.y + a.height;
}

test('a chain runs from left to right', () => {
    const nodes = ['a', 'b', 'c'].map(box);
    layered(nodes, [edge('a', 'b'), edge('b', 'c')]);
    assert.ok(nodes[0].x + 100 < nodes[1].x);
    assert.ok(nodes[1].x + 100 < nodes[2].x);
});

test('no nodes are an empty picture', () => {
    assert.deepEqual(layered([], []), {width: 1, height: 1});
});

test('a circle is drawn, one of its edges backwards', () => {
    const nodes = ['a', 'b', 'c'].map(box);
    const edges = [edge('a', 'b'), edge('b', 'c'), edge('c', 'a')];
    layered(nodes, edges);
    assert.equal(edges.filter(one => one.back).length, 1);
    for (const one of edges)
        assert.ok(one.path.length >= 2);
});

test('an edge to its own node goes round it', () => {
    const nodes = [box('a')], edges = [edge('a', 'a')];
    layered(nodes, edges);
    assert.ok(edges[0].loop);
    assert.equal(edges[0].path.length, 4);
});

test('two crossed edges are uncrossed by the order of the nodes', () => {
    const nodes = ['a', 'b', 'y', 'x'].map(box);
    layered(nodes, [edge('a', 'x'), edge('b', 'y')]);
    const [a, b, y, x] = nodes;
    assert.equal(Math.sign(a.y - b.y), Math.sign(x.y - y.y));
});

test('random graphs: nothing overlaps, everything is inside, every edge has its path', () => {
    let seed = 1;
    const random = limit => {
        seed = (seed * 48271) % 2147483647;
        return seed % limit;
    };
    for (let round = 0; round < 30; round++) {
        const nodes = Array.from({length: 2 + random(30)}, (_, i) => box(`n${i}`));
        const edges = Array.from(
            {length: random(60)},
            () => edge(`n${random(nodes.length)}`, `n${random(nodes.length)}`));
        const {width, height} = layered(nodes, edges);
        nodes.forEach((node, i) => {
            assert.ok(node.x >= 0 && node.x + node.width <= width + 1e-6);
            assert.ok(node.y >= -1e-6 && node.y + node.height <= height + 1e-6);
            for (const other of nodes.slice(i + 1))
                assert.ok(!overlaps(node, other));
        });
        for (const one of edges)
            for (const [x, y] of one.path)
                assert.ok(Number.isFinite(x) && Number.isFinite(y));
    }
});
