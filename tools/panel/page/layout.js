// SPDX-License-Identifier: MIT
// A layered layout of nodes with ports: ranks, order with few crossings, positions, curves. Left to
// right.
//
// nodes: [{id, width, height}], edges: [{from, to, out, in}] with the nodes' ids and the ports'
// offsets from the top of their nodes. Sets x, y of the nodes and path ([[x, y], …]) of the edges;
// returns {width, height}.

const gapX = 90, gapY = 16, sweeps = 16;

/// Reverses the edges that close a circle, and returns for each node its outgoing and incoming
/// edges.
function acyclic(nodes, edges) {
    const out = new Map(nodes.map(node => [node, []])),
          into = new Map(nodes.map(node => [node, []]));
    for (const edge of edges)
        out.get(edge.a).push(edge);
    const seen = new Map();
    const starts = [...nodes].sort(
        (a, b) => (edges.some(e => e.b === a) ? 1 : 0) - (edges.some(e => e.b === b) ? 1 : 0));
    for (const start of starts) {
        if (seen.has(start)) continue;
        const stack = [[start, 0]];
        seen.set(start, 1);
        while (stack.length > 0) {
            const top = stack[stack.length - 1], edge = out.get(top[0])[top[1]++];
            if (!edge) {
                seen.set(top[0], 2);
                stack.pop();
                continue;
            }
            const state = seen.get(edge.b);
            if (state === 1)
                edge.reversed = true;
            else if (!state) {
                seen.set(edge.b, 1);
                stack.push([edge.b, 0]);
            }
        }
    }
    for (const list of out.values())
        list.length = 0;
    for (const edge of edges) {
        if (edge.reversed) [edge.a, edge.b, edge.ya, edge.yb] = [edge.b, edge.a, edge.yb, edge.ya];
        if (edge.a === edge.b) continue;
        out.get(edge.a).push(edge);
        into.get(edge.b).push(edge);
    }
    return {out, into};
}

/// Longest path from the sources, then each node as near to its successors as possible.
function rank(nodes, out, into) {
    const waiting = new Map(nodes.map(node => [node, into.get(node).length])),
          order = nodes.filter(node => waiting.get(node) === 0);
    for (const node of nodes)
        node.rank = 0;
    for (let i = 0; i < order.length; i++)
        for (const edge of out.get(order[i])) {
            edge.b.rank = Math.max(edge.b.rank, order[i].rank + 1);
            waiting.set(edge.b, waiting.get(edge.b) - 1);
            if (waiting.get(edge.b) === 0) order.push(edge.b);
        }
    for (let i = order.length - 1; i >= 0; i--) {
        const next = out.get(order[i]).map(edge => edge.b.rank);
        if (next.length > 0 && into.get(order[i]).length === 0)
            order[i].rank = Math.min(...next) - 1;
    }
}

/// Counts pairs of links that cross between two ranks, by a Fenwick tree.
function crossings(links, size) {
    const tree = new Int32Array(size + 1),
          sorted = links.map(link => [link.a.place + link.ya / 1e5, link.b.place, link.yb])
                       .sort((p, q) => p[0] - q[0] || p[1] - q[1] || p[2] - q[2]);
    let count = 0, inserted = 0;
    for (const [, place] of sorted) {
        let notAbove = 0;
        for (let i = place + 1; i > 0; i -= i & -i)
            notAbove += tree[i];
        count += inserted - notAbove;
        for (let i = place + 1; i <= size; i += i & -i)
            tree[i]++;
        inserted++;
    }
    return count;
}

function orderRanks(ranks, links) {
    const down = new Map(), up = new Map();
    for (const link of links) {
        if (!down.has(link.a)) down.set(link.a, []);
        if (!up.has(link.b)) up.set(link.b, []);
        down.get(link.a).push(link);
        up.get(link.b).push(link);
    }
    const number = () => ranks.forEach(row => row.forEach((node, i) => {
        node.place = i;
    }));
    const perRank = ranks.map(() => []);
    for (const link of links)
        perRank[link.a.rank].push(link);
    const total = () => ranks.reduce(
        (sum, row, r) =>
            sum + (r + 1 < ranks.length ? crossings(perRank[r], ranks[r + 1].length) : 0),
        0);
    // The first order: depth first, so that what belongs together is together.
    const seen = new Set(), first = ranks.map(() => []);
    const visit = start => {
        const stack = [start];
        while (stack.length > 0) {
            const node = stack.pop();
            if (seen.has(node)) continue;
            seen.add(node);
            first[node.rank].push(node);
            for (const link of [...(down.get(node) ?? [])].reverse())
                stack.push(link.b);
        }
    };
    ranks.forEach(row => row.forEach(visit));
    first.forEach((row, r) => {
        ranks[r] = row;
    });
    number();
    let best = total(), kept = ranks.map(row => [...row]);
    for (let sweep = 0; sweep < sweeps && best > 0; sweep++) {
        const forward = sweep % 2 === 0;
        for (let k = 1; k < ranks.length; k++) {
            const row = ranks[forward ? k : ranks.length - 1 - k];
            for (const node of row) {
                const near = (forward ? up : down).get(node) ?? [];
                const at = near.map(
                    link => forward ? link.a.place + link.ya / 1e4 : link.b.place + link.yb / 1e4);
                node.weight =
                    at.length > 0 ? at.reduce((x, y) => x + y, 0) / at.length : node.place;
            }
            row.sort((a, b) => a.weight - b.weight);
            row.forEach((node, i) => {
                node.place = i;
            });
        }
        const now = total();
        if (now < best) {
            best = now;
            kept = ranks.map(row => [...row]);
        }
    }
    kept.forEach((row, r) => {
        ranks[r] = row;
    });
    number();
    return {down, up};
}

/// Moves nodes towards the mean of their neighbours' ports, keeping order and distance.
function placeRows(ranks, down, up) {
    for (const row of ranks) {
        let y = 0;
        for (const node of row) {
            node.y = y;
            y += node.height + gapY;
        }
    }
    for (let pass = 0; pass < 12; pass++) {
        const forward = pass % 2 === 0;
        for (let k = 0; k < ranks.length; k++) {
            const row = ranks[forward ? k : ranks.length - 1 - k];
            const wanted = row.map(node => {
                const links = [
                    ...(up.get(node) ?? []).map(link => link.a.y + link.ya - link.yb),
                    ...(down.get(node) ?? []).map(link => link.b.y + link.yb - link.ya)
                ];
                return links.length > 0 ? links.reduce((x, y) => x + y, 0) / links.length : node.y;
            });
            // Blocks of nodes that touch each other move together to their mean wish.
            const blocks = [];
            row.forEach((node, i) => {
                let block = {
                    nodes: [node],
                    offset: [0],
                    size: node.height + gapY,
                    sum: wanted[i],
                    y: wanted[i]
                };
                while (blocks.length > 0 &&
                       blocks[blocks.length - 1].y + blocks[blocks.length - 1].size > block.y) {
                    const before = blocks.pop();
                    const shift = before.size;
                    before.nodes.push(...block.nodes);
                    before.offset.push(...block.offset.map(o => o + shift));
                    before.sum += block.sum - shift * block.nodes.length;
                    before.size += block.size;
                    before.y = before.sum / before.nodes.length;
                    block = before;
                }
                blocks.push(block);
            });
            for (const block of blocks)
                block.nodes.forEach((node, i) => {
                    node.y = block.y + block.offset[i];
                });
        }
    }
}

export function layered(nodes, edges) {
    const byId = new Map(nodes.map(node => [node.id, node]));
    const work = edges.map(
        edge => ({edge, a: byId.get(edge.from), b: byId.get(edge.to), ya: edge.out, yb: edge.in}));
    const {out, into} = acyclic(nodes, work);
    rank(nodes, out, into);
    const least = Math.min(0, ...nodes.map(node => node.rank));
    for (const node of nodes)
        node.rank -= least;
    const ranks = Array.from({length: 1 + Math.max(0, ...nodes.map(node => node.rank))}, () => []);
    for (const node of nodes)
        ranks[node.rank].push(node);
    const links = [];
    for (const one of work) {
        if (one.a === one.b) {
            one.chain = [];
            continue;
        }
        let last = one.a, y = one.ya;
        one.chain = [];
        for (let r = one.a.rank + 1; r < one.b.rank; r++) {
            const bend = {rank: r, width: 0, height: 4};
            ranks[r].push(bend);
            one.chain.push(bend);
            links.push({a: last, b: bend, ya: y, yb: 2});
            last = bend;
            y = 2;
        }
        links.push({a: last, b: one.b, ya: y, yb: one.yb});
    }
    const {down, up} = orderRanks(ranks, links);
    placeRows(ranks, down, up);
    let x = 0;
    const top = Math.min(0, ...ranks.flat().map(node => node.y));
    let height = 0;
    for (const row of ranks) {
        const width = Math.max(0, ...row.map(node => node.width));
        for (const node of row) {
            node.x = x + (width - node.width) / 2;
            node.y -= top;
            height = Math.max(height, node.y + node.height);
        }
        x += width + gapX;
    }
    for (const {edge, a, b, ya, yb, chain, reversed} of work) {
        if (a === b) {  // round the node
            edge.path = [
                [a.x + a.width, a.y + edge.out], [a.x + a.width + 30, a.y - 8], [a.x - 30, a.y - 8],
                [a.x, a.y + edge.in]
            ];
            edge.loop = true;
            continue;
        }
        const bends = chain.map(bend => [bend.x, bend.y + 2]);
        if (!reversed)
            edge.path = [[a.x + a.width, a.y + ya], ...bends, [b.x, b.y + yb]];
        else
            edge.path = [
                [b.x + b.width, b.y + yb], [b.x + b.width + 25, b.y - 10], ...bends.reverse(),
                [a.x - 25, a.y - 10], [a.x, a.y + ya]
            ];  // the output is on the right of b
        edge.back = Boolean(reversed);
    }
    return {width: Math.max(x - gapX, 1), height: Math.max(height, 1)};
}
