// SPDX-License-Identifier: MIT
// The layout of a graph on a narrow screen: from top to bottom, in rows that are not wider than the
// screen. Edges leave a box at its bottom and run between the boxes of the rows below.
import {layered} from './layout.js';

const gapX = 18, gapY = 38;            // px: between boxes, and between rows
const margin = 12, title = 34;         // px: inside of a frame, and above its boxes
const passes = 6;                      // over the rows, to bring boxes below their neighbours
const spread = 4, maxSpread = 3;       // px between edges in one gap, and how many have it

/**
 * A box or a frame.
 * @typedef {{id: string, width: number, height: number, x?: number, y?: number}} Node
 */
/** @typedef {{nodes: Node[], top: number, bottom: number}} Row */
/** @typedef {{rows: Row[], rowOf: Map<string, number>, used: Map<string, number>}} Level */

const centre = node => node.x + node.width / 2;

/// The nodes of each rank, in an order with few crossings.
function ranksOf(nodes, links) {
    const turned = nodes.map(node => ({id: node.id, width: node.height, height: node.width, node}));
    const half = new Map(nodes.map(({id, width}) => [id, width / 2]));
    layered(
        turned,
        links.map(({from, to}) => ({from, to, out: half.get(from), in : half.get(to)})));
    /** @type {any[][]} */
    const ranks = [];
    for (const one of /** @type {any[]} */ (turned))
        (ranks[one.rank] ??= []).push(one);
    return ranks.filter(rank => rank)
        .map(rank => rank.sort((a, b) => a.y - b.y).map(({node}) => node));
}

/// Splits what is wider than the screen.
function rowsOf(rank, width) {
    const rows = [[]];
    let used = 0;
    for (const node of rank) {
        const row = rows[rows.length - 1];
        if (row.length > 0 && used + node.width > width) {
            rows.push([node]);
            used = node.width + gapX;
            continue;
        }
        row.push(node);
        used += node.width + gapX;
    }
    return rows;
}

/// Places the nodes of a row as near as possible to where they want to be, in their order.
function placeRow(row, wanted, width) {
    let least = 0;
    row.forEach((node, i) => {
        node.x = Math.max(least, wanted[i]);
        least = node.x + node.width + gapX;
    });
    let most = width;
    for (const node of [...row].reverse()) {
        node.x = Math.max(0, Math.min(node.x, most - node.width));
        most = node.x - gapX;
    }
}

/// Brings each node below or above the middle of its neighbours.
function placeAcross(rows, links, width) {
    const near = new Map(rows.flat().map(node => [node.id, []]));
    const byId = new Map(rows.flat().map(node => [node.id, node]));
    for (const {from, to} of links) {
        near.get(from).push(byId.get(to));
        near.get(to).push(byId.get(from));
    }
    for (const row of rows) {
        const all = row.reduce((sum, node) => sum + node.width + gapX, -gapX);
        let x = (width - all) / 2;
        for (const node of row) {
            node.x = Math.max(0, x);
            x += node.width + gapX;
        }
    }
    const wish = node => {
        const others = near.get(node.id);
        if (others.length === 0) return node.x;
        return others.reduce((sum, other) => sum + centre(other), 0) / others.length -
            node.width / 2;
    };
    for (let pass = 0; pass < passes; pass++)
        for (const row of pass % 2 === 0 ? rows : [...rows].reverse())
            placeRow(row, row.map(wish), width);
    const left = Math.min(...rows.map(row => row[0].x)),
          right = Math.max(...rows.map(row => row[row.length - 1]).map(one => one.x + one.width));
    for (const node of rows.flat())
        node.x += (width - left - right) / 2;
}

/**
 * Sets x and y of the nodes, from (0, 0) on.
 * @returns {Level & {width: number, height: number}}
 */
function stack(nodes, links, wanted) {
    const width = Math.max(wanted, 1, ...nodes.map(node => node.width)),
          all = ranksOf(nodes, links).flatMap(rank => rowsOf(rank, width));
    placeAcross(all, links, width);
    const rowOf = new Map();
    let y = 0;
    const rows = all.map((row, i) => {
        const top = y, bottom = y + Math.max(...row.map(node => node.height));
        for (const node of row) {
            node.y = top;
            rowOf.set(node.id, i);
        }
        y = bottom + gapY;
        return {nodes: row, top, bottom};
    });
    return {rows, rowOf, used: new Map(), width, height: Math.max(1, y - gapY)};
}

/// The places in a row where an edge can pass: between its nodes and beside them.
function gapsOf({nodes}) {
    const last = nodes[nodes.length - 1],
          between = nodes.slice(1).map((node, i) => (nodes[i].x + nodes[i].width + node.x) / 2);
    return [nodes[0].x - gapX / 2, ...between, last.x + last.width + gapX / 2];
}

/// The points between two rows of a level, through the nearest gap of each row on the way. Edges in
/// the same gap are beside each other.
function pointsBetween({rows, rowOf, used}, from, to, begin, end) {
    const first = rowOf.get(from), last = rowOf.get(to), step = first < last ? 1 : -1;
    const points = [];
    let [x] = begin;
    for (let i = first + step; i !== last; i += step) {
        const {top, bottom} = rows[i], share = 1 / (Math.abs(last - i) + 1);
        const wanted = x + (end[0] - x) * share, gaps = gapsOf(rows[i]);
        const gap = gaps.reduce((a, b) => Math.abs(b - wanted) < Math.abs(a - wanted) ? b : a);
        const key = `${i} ${gap}`, count = used.get(key) ?? 0;
        used.set(key, count + 1);
        x = gap + spread * (count % maxSpread - (maxSpread - 1) / 2);
        points.push(...(step > 0 ? [[x, top], [x, bottom]] : [[x, bottom], [x, top]]));
    }
    return points;
}

/// Where the edges at a side of a box begin or end: beside each other, in the order of their other
/// ends.
function sides(edges, boxes) {
    const lists = new Map();
    const add = (edge, id, isBottom, other) => {
        const key = `${id} ${isBottom}`;
        if (!lists.has(key)) lists.set(key, {box: boxes.get(id), isBottom, list: []});
        lists.get(key).list.push({edge, isStart: id === edge.from, at: centre(other)});
    };
    for (const edge of edges) {
        const from = boxes.get(edge.from), to = boxes.get(edge.to);
        add(edge, edge.from, !edge.back, to);
        add(edge, edge.to, edge.back, from);
    }
    const ends = new Map(edges.map(edge => [edge, {}]));
    for (const {box, isBottom, list} of lists.values())
        list.sort((a, b) => a.at - b.at).forEach(({edge, isStart}, i) => {
            const x = box.x + box.width * (i + 1) / (list.length + 1);
            ends.get(edge)[isStart ? 'begin' : 'end'] = [x, box.y + (isBottom ? box.height : 0)];
        });
    return ends;
}

/// Moves the inside of a frame to where the frame is.
function moveInside({boxes, level}, frame) {
    const dx = frame.x + margin, dy = frame.y + title;
    for (const box of boxes) {
        box.x += dx;
        box.y += dy;
    }
    for (const row of level.rows) {
        row.top += dy;
        row.bottom += dy;
    }
}

/**
 * Sets x, y of boxes and frames, size of frames, path of edges.
 * @param {import('./graph_model.js').Graph} graph
 * @param {number} width of the screen, in px of the drawing
 * @returns {{width: number, height: number}}
 */
export function portrait(graph, width) {
    const boxes = new Map(graph.boxes.map(box => [box.id, box])),
          frames = new Map(graph.frames.map(frame => [frame.title, frame]));
    const nodeOf = id => frames.get(boxes.get(id).group)?.id ?? id;
    const outer = [], inner = new Map(graph.frames.map(frame => [frame.id, []]));
    for (const edge of graph.edges) {
        const from = nodeOf(edge.from), to = nodeOf(edge.to);
        if (from !== to)
            outer.push({from, to});
        else if (edge.from !== edge.to)
            inner.get(from).push({from: edge.from, to: edge.to});
    }
    const insides = graph.frames.map(frame => {
        const own = graph.boxes.filter(box => box.group === frame.title),
              level = stack(own, inner.get(frame.id), width - 2 * margin);
        frame.width = level.width + 2 * margin;
        frame.height = level.height + title + margin;
        return {frame, boxes: own, level};
    });
    const free = graph.boxes.filter(box => !frames.has(box.group));
    const whole = stack([...free, ...graph.frames], outer, width);
    for (const inside of insides)
        moveInside(inside, inside.frame);
    const levelOf = new Map(insides.map(({frame, level}) => [frame.id, level]));
    const drawn = graph.edges.filter(edge => edge.from !== edge.to);
    const levels = drawn.map(edge => {
        const from = nodeOf(edge.from), to = nodeOf(edge.to), isInner = from === to;
        const level = isInner ? levelOf.get(from) : whole,
              ends = isInner ? [edge.from, edge.to] : [from, to];
        edge.vertical = true;
        edge.back = level.rowOf.get(ends[0]) > level.rowOf.get(ends[1]);
        return {edge, level, ends};
    });
    const places = sides(drawn, boxes);
    for (const {edge, level, ends: [from, to]} of levels) {
        const {begin, end} = places.get(edge);
        edge.path = [begin, ...pointsBetween(level, from, to, begin, end), end];
    }
    graph.edges = drawn;
    return {width: whole.width, height: whole.height};
}
