// SPDX-License-Identifier: MIT
// The layout of a graph whose open groups are clusters: each is laid out by itself, and is one node
// of the whole.
import {layered} from './layout.js';

const margin = 18, title = 30;  // px: inside of a frame, and above its boxes

/// Lays out the inside of a frame, from (0, 0) on.
function inside(graph, frame) {
    const boxes = graph.boxes.filter(box => box.group === frame.title),
          ids = new Set(boxes.map(box => box.id)),
          edges = graph.edges.filter(edge => ids.has(edge.from) && ids.has(edge.to));
    const size = layered(boxes, edges);
    frame.width = size.width + 2 * margin;
    frame.height = size.height + 2 * margin + title;
    return {boxes, edges};
}

/// Moves boxes and paths into their frame.
function move({boxes, edges}, frame) {
    const dx = frame.x + margin, dy = frame.y + margin + title;
    for (const box of boxes) {
        box.x += dx;
        box.y += dy;
    }
    for (const edge of edges)
        edge.path = edge.path.map(([x, y]) => [x + dx, y + dy]);
}

/**
 * A path between two nodes, continued to the ports of the boxes in them.
 * @returns {number[][]}
 */
function continued(edge, path, from, to) {
    const out = [from.x + from.width, from.y + edge.out], into = [to.x, to.y + edge.in];
    const isAt = (point, other) => point[0] === other[0] && point[1] === other[1];
    const begin = isAt(path[0], out) ? [] : [out],
          end = isAt(path[path.length - 1], into) ? [] : [into];
    return [...begin, ...path, ...end];
}

/**
 * Sets x, y of boxes and frames, size of frames, path of edges.
 * @param {import('./graph_model.js').Graph} graph
 * @returns {{width: number, height: number}}
 */
export function clustered(graph) {
    if (graph.frames.length === 0) return layered(graph.boxes, graph.edges);
    const insides = graph.frames.map(frame => inside(graph, frame));
    const frameOf = new Map(graph.frames.map(frame => [frame.title, frame])),
          boxes = new Map(graph.boxes.map(box => [box.id, box]));
    /// The node of the whole that has a port of a box, and where.
    const nodeOf = (box, y) => {
        const frame = frameOf.get(box.group);
        return frame ? {id: frame.id, y: box.y + margin + title + y} : {id: box.id, y};
    };
    /** @type {any[]} */
    const outer = [];
    for (const edge of graph.edges) {
        const from = boxes.get(edge.from), to = boxes.get(edge.to);
        if (from.group !== '' && from.group === to.group) continue;
        const begin = nodeOf(from, edge.out), end = nodeOf(to, edge.in);
        outer.push({edge, from: begin.id, to: end.id, out: begin.y, in : end.y});
    }
    const nodes = [...graph.boxes.filter(box => box.group === ''), ...graph.frames];
    const size = layered(nodes, outer);
    graph.frames.forEach((frame, i) => move(insides[i], frame));
    for (const {edge, path, back, loop} of outer) {
        edge.path = continued(edge, path, boxes.get(edge.from), boxes.get(edge.to));
        edge.back = back;
        edge.loop = loop;
    }
    return size;
}
