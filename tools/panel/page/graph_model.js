// SPDX-License-Identifier: MIT
// The boxes and edges of the drawing of a netlist, without drawing anything.
import {instanceOf} from './graph_groups.js';

export const line = 17;       // px: of a port
export const head = 24;       // px: of a box
export const listHead = 32;   // px: the same where ports are below each other, for fingers
export const listLine = 24;   // px: of a port there
const valueWidth = 100;       // px: beside the name of a port there
export const groupHead = 46;  // px: of a group that is folded: its name and size

/**
 * @typedef {object} Port
 * @property {any} pin
 * @property {string} label
 * @property {number} y from the top of its box
 * @property {boolean} input
 */

/**
 * @typedef {object} Box
 * @property {string} id of an instance, or of a group that is folded
 * @property {string} title
 * @property {string} group that it is in, when that is open; or ''
 * @property {Set<string>} [members] instances of a group that is folded
 * @property {Set<string>} names instances, pins and signals that it stands for
 * @property {any[]} inputs pins
 * @property {any[]} outputs pins
 * @property {Set<string>} threads
 * @property {boolean} collapsed
 * @property {boolean} [isList] its ports are below each other, each with its value
 * @property {Map<string, Port>} ports none of a group
 * @property {number} width
 * @property {number} height
 * @property {number} [x] set by the layout
 * @property {number} [y]
 */

/**
 * @typedef {object} Edge
 * @property {any[]} signals more than one for a bundle
 * @property {string} type of them; '' for several types
 * @property {boolean} bundle from or to a group
 * @property {string} from
 * @property {string} to
 * @property {number} out of the port, from the top of its box
 * @property {number} in
 * @property {number[][]} [path] set by the layout
 * @property {boolean} [back]
 * @property {boolean} [loop]
 * @property {boolean} [vertical] it runs from top to bottom, or back
 */

/**
 * @typedef {object} Frame of a group that is open
 * @property {string} id
 * @property {string} title
 * @property {number} [x] set by the layout
 * @property {number} [y]
 * @property {number} [width]
 * @property {number} [height]
 */

/**
 * @typedef {object} Graph
 * @property {Box[]} boxes
 * @property {Edge[]} edges
 * @property {Frame[]} frames
 */

/// The id of a group: no instance has a colon in its name.
export const groupId = name => `group:${name}`;
/// The name of a group by its id; '' for any other id.
export const groupName = id => id.startsWith('group:') ? id.slice(6) : '';

/// The name of a pin in its box.
const short = (pin, id) => pin.name.startsWith(id + '.') ? pin.name.slice(id.length + 1) : pin.name;

/// Sets the size of a folded group.
function shapeGroup(box, widthOf) {
    box.width = Math.max(110, widthOf(box.title) * 1.15 + 36);
    box.height = groupHead;
}

/// Sets the size of a box whose ports are below each other, and its ports: inputs, then outputs.
function shapeList(box, widthOf) {
    const pins = box.collapsed ? [] : [...box.inputs, ...box.outputs];
    const labels = pins.map(pin => widthOf(short(pin, box.id)) + valueWidth);
    box.width = Math.max(90, widthOf(box.title) * 1.15 + 36, ...labels);
    box.height = box.collapsed ? listHead : listHead + listLine * pins.length + 4;
    pins.forEach((pin, i) => box.ports.set(pin.name, {
        pin,
        label: short(pin, box.id),
        y: listHead + listLine * (i + .5),
        input: i < box.inputs.length
    }));
}

/// Sets the size of a box and its ports.
function shape(box, widthOf, isList) {
    box.isList = isList;
    if (box.members) return shapeGroup(box, widthOf);
    if (isList) return shapeList(box, widthOf);
    const widest = pins => Math.max(0, ...pins.map(pin => widthOf(short(pin, box.id)))),
          title = widthOf(box.title) + 36;
    box.width = box.collapsed ?
        title :
        Math.max(widest(box.inputs) + widest(box.outputs) + 34, title, 90);
    box.height = box.collapsed ?
        head :
        head + line * Math.max(box.inputs.length, box.outputs.length) + 4;
    for (const list of [box.inputs, box.outputs])
        list.forEach((pin, i) => box.ports.set(pin.name, {
            pin,
            label: short(pin, box.id),
            y: box.collapsed ? head / 2 : head + line * (i + .5),
            input: list === box.inputs
        }));
}

/** Builds a graph from signals. */
class Builder {
    constructor({groups, open, collapsed, isList = false}) {
        this.isList = isList;
        this.groups = groups;
        this.open = open;
        this.collapsed = collapsed;
        /** @type {Map<string, Box>} */
        this.boxes = new Map();
        /** @type {Map<string, Edge>} */
        this.bundles = new Map();
        /** @type {{edge: Edge, writer: any, pin: any}[]} */
        this.links = [];
    }

    /// The box of an instance, or of the folded group that it is in.
    box(instance) {
        const group = this.groups.get(instance) ?? '', isFolded = group && !this.open.has(group),
              id = isFolded ? groupId(group) : instance;
        if (!this.boxes.has(id))
            this.boxes.set(id, {
                id,
                title: isFolded ? group : instance,
                group: isFolded ? '' : group,
                members: isFolded ? new Set() : undefined,
                names: new Set(),
                inputs: [],
                outputs: [],
                threads: new Set(),
                collapsed: this.collapsed.has(id),
                ports: new Map(),
                width: 0,
                height: 0
            });
        const box = this.boxes.get(id);
        box.members?.add(instance);
        box.names.add(instance);
        return box;
    }

    addSignal(signal, all) {
        const pins = signal.pins.map(name => all.get(name)).filter(pin => pin),
              writer = pins.find(pin => pin.name === signal.writer) ??
            pins.find(pin => pin.dir === 'I/O');
        for (const pin of pins) {
            const at = this.box(instanceOf(pin));
            at.names.add(pin.name).add(signal.name);
            if (pin.thread) at.threads.add(pin.thread);
            if (!at.members) (pin === writer ? at.outputs : at.inputs).push(pin);
        }
        if (!writer) return;
        for (const pin of pins)
            if (pin !== writer) this.link(signal, writer, pin);
    }

    link(signal, writer, pin) {
        const from = this.box(instanceOf(writer)), to = this.box(instanceOf(pin)),
              bundle = this.isList || Boolean(from.members || to.members);
        if (from === to && bundle) return;  // inside a folded group
        const key = `${from.id} ${to.id}`;
        if (bundle && this.bundles.has(key)) return this.bundles.get(key).signals.push(signal);
        const edge =
            {signals: [signal], type: '', bundle, from: from.id, to: to.id, out: 0, in : 0};
        if (bundle) this.bundles.set(key, edge);
        this.links.push({edge, writer, pin});
    }

    /// Sets where edges begin and end, and what types they have.
    finish(edge, writer, pin) {
        const from = this.boxes.get(edge.from), to = this.boxes.get(edge.to),
              types = new Set(edge.signals.map(signal => signal.type));
        edge.type = types.size === 1 ? [...types][0] : '';
        const middle = box => (box.members ? groupHead : head) / 2;
        edge.out = edge.bundle ? middle(from) : from.ports.get(writer.name).y;
        edge.in = edge.bundle ? middle(to) : to.ports.get(pin.name).y;
        return edge;
    }

    /** @returns {Graph} */
    graph(widthOf) {
        for (const box of this.boxes.values())
            shape(box, widthOf, this.isList);
        const groups = new Set([...this.boxes.values()].map(box => box.group).filter(name => name));
        return {
            boxes: [...this.boxes.values()],
            edges: this.links.map(({edge, writer, pin}) => this.finish(edge, writer, pin)),
            frames: [...groups].map(title => ({id: groupId(title), title}))
        };
    }
}

/**
 * Builds boxes with ports, and edges, from the linked pins. Links from or to a folded group are one
 * edge for each pair of boxes.
 * @param {Map<string, any>} all what has a value, by its name
 * @param {object} how
 * @param {Map<string, string>} how.groups the group of each instance that has one
 * @param {Set<string>} how.open groups that are not folded
 * @param {Set<string>} how.collapsed boxes without their ports
 * @param {boolean} [how.isList] for a narrow screen: ports are below each other, and all links
 *     between two boxes are one edge
 * @param {(text: string) => number} widthOf the width of a text in px
 * @returns {Graph}
 */
export function build(all, how, widthOf) {
    const builder = new Builder(how);
    for (const [name, object] of all)
        if (object.kind === 'sig' && object.name === name) builder.addSignal(object, all);
    return builder.graph(widthOf);
}

/**
 * The instances of which no pin is linked.
 * @param {Iterable<any>} objects
 * @returns {string[]}
 */
export function unlinked(objects) {
    const linked = new Map();
    for (const one of objects)
        if (one.kind === 'pin' && one.instance)
            linked.set(one.instance, linked.get(one.instance) || Boolean(one.signal));
    return [...linked].filter(([, isLinked]) => !isLinked).map(([name]) => name);
}

/**
 * The box of a name: of an instance, a group, a pin or a signal.
 * @param {Graph} graph
 * @param {string} name
 */
export const boxOf = ({boxes}, name) =>
    boxes.find(one => one.id === name) ?? boxes.find(one => one.names.has(name));

/// Keeps the boxes whose names are in `kept`, and the edges between them.
function part({boxes, edges, frames}, kept) {
    const left = boxes.filter(one => kept.has(one.id)),
          groups = new Set(left.map(one => one.group));
    return {
        boxes: left,
        edges: edges.filter(edge => kept.has(edge.from) && kept.has(edge.to)),
        frames: frames.filter(one => groups.has(one.title))
    };
}

/**
 * Keeps what is at most `depth` edges from the boxes of a name; everything when it has none.
 * @param {Graph} graph
 * @param {string} around
 * @param {number} depth
 * @returns {Graph}
 */
export function neighbourhood(graph, around, depth) {
    let near = new Set(graph.boxes.filter(one => one.id === around || one.names.has(around))
                           .map(one => one.id));
    if (near.size === 0) return graph;
    for (let i = 0; i < depth; i++) {
        const wider = new Set(near);
        for (const edge of graph.edges) {
            if (near.has(edge.from)) wider.add(edge.to);
            if (near.has(edge.to)) wider.add(edge.from);
        }
        near = wider;
    }
    return part(graph, near);
}

/**
 * Keeps the first boxes.
 * @param {Graph} graph
 * @param {number} count
 * @returns {Graph}
 */
export const firstBoxes = (graph, count) => graph.boxes.length <= count ?
    graph :
    part(graph, new Set(graph.boxes.slice(0, count).map(one => one.id)));
