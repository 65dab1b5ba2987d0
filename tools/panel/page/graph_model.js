// SPDX-License-Identifier: MIT
// The boxes and edges of the drawing of a netlist, without drawing anything.

export const line = 17;  // px: of a port
export const head = 24;  // px: of a box

/**
 * @typedef {object} Port
 * @property {any} pin
 * @property {string} label
 * @property {number} y from the top of its box
 * @property {boolean} input
 */

/**
 * @typedef {object} Box
 * @property {string} id
 * @property {any[]} inputs pins
 * @property {any[]} outputs pins
 * @property {Set<string>} threads
 * @property {boolean} collapsed
 * @property {Map<string, Port>} ports
 * @property {number} width
 * @property {number} height
 * @property {number} [x] set by the layout
 * @property {number} [y]
 */

/**
 * @typedef {object} Edge
 * @property {any} signal
 * @property {any} writer pin
 * @property {any} pin that reads
 * @property {string} from
 * @property {string} to
 * @property {number} out of the port, from the top of its box
 * @property {number} in
 * @property {number[][]} [path] set by the layout
 * @property {boolean} [back]
 * @property {boolean} [loop]
 */

/**
 * @typedef {object} Graph
 * @property {Box[]} boxes
 * @property {Edge[]} edges
 */

/// The name of the box that a pin belongs to: its instance, or with groups its component.
const owner = (pin, grouped) => grouped ? pin.component ?? pin.name.split('.')[0] :
                                          pin.instance ?? pin.component ?? pin.name.split('.')[0];

/// The name of a pin in its box.
const short = (pin, id) => pin.name.startsWith(id + '.') ? pin.name.slice(id.length + 1) : pin.name;

/// Adds the pins of a signal to their boxes, and an edge from its writer to each reader.
function addSignal(signal, all, grouped, box, edges) {
    const pins = signal.pins.map(name => all.get(name)).filter(pin => pin),
          writer = pins.find(pin => pin.name === signal.writer) ??
        pins.find(pin => pin.dir === 'I/O');
    for (const pin of pins) {
        const at = box(owner(pin, grouped));
        if (pin.thread) at.threads.add(pin.thread);
        (pin === writer ? at.outputs : at.inputs).push(pin);
    }
    if (!writer) return;
    for (const pin of pins)
        if (pin !== writer)
            edges.push({
                signal,
                writer,
                pin,
                from: owner(writer, grouped),
                to: owner(pin, grouped),
                out: 0,
                in : 0
            });
}

/// Sets the size of a box and its ports.
function shape(box, widthOf) {
    const widest = pins => Math.max(0, ...pins.map(pin => widthOf(short(pin, box.id)))),
          title = widthOf(box.id) + 36;
    box.width = box.collapsed ?
        title :
        Math.max(widest(box.inputs) + widest(box.outputs) + 34, title, 90);
    box.height = box.collapsed ?
        head :
        head + line * Math.max(box.inputs.length, box.outputs.length) + 4;
    box.ports = new Map();
    for (const list of [box.inputs, box.outputs])
        list.forEach((pin, i) => box.ports.set(pin.name, {
            pin,
            label: short(pin, box.id),
            y: box.collapsed ? head / 2 : head + line * (i + .5),
            input: list === box.inputs
        }));
}

/**
 * Builds boxes with ports, and edges, from the linked pins.
 * @param {Map<string, any>} all what has a value, by its name
 * @param {object} how
 * @param {boolean} how.grouped a box per component, not per instance
 * @param {Set<string>} how.collapsed boxes without their ports
 * @param {(text: string) => number} widthOf the width of a text in px
 * @returns {Graph}
 */
export function build(all, {grouped, collapsed}, widthOf) {
    /** @type {Map<string, any>} */
    const boxes = new Map();
    const edges = [];
    const box = id => {
        if (!boxes.has(id))
            boxes.set(id, {
                id,
                inputs: [],
                outputs: [],
                threads: new Set(),
                collapsed: collapsed.has(id)
            });
        return boxes.get(id);
    };
    for (const [name, object] of all)
        if (object.kind === 'sig' && object.name === name)
            addSignal(object, all, grouped, box, edges);
    for (const one of boxes.values())
        shape(one, widthOf);
    for (const edge of edges) {
        edge.out = boxes.get(edge.from).ports.get(edge.writer.name).y;
        edge.in = boxes.get(edge.to).ports.get(edge.pin.name).y;
    }
    return {boxes: [...boxes.values()], edges};
}

/**
 * The box of a name: of an instance, a pin or a signal.
 * @param {Graph} graph
 * @param {string} name
 */
export const boxOf = ({boxes}, name) => boxes.find(
    one => one.id === name || one.ports.has(name) ||
        [...one.ports.values()].some(port => port.pin.signal === name));

/// Keeps the boxes whose names are in `kept`, and the edges between them.
const part = ({boxes, edges}, kept) => ({
    boxes: boxes.filter(one => kept.has(one.id)),
    edges: edges.filter(edge => kept.has(edge.from) && kept.has(edge.to))
});

/**
 * Keeps what is at most `depth` edges from the boxes of a name; everything when it has none.
 * @param {Graph} graph
 * @param {string} around
 * @param {number} depth
 * @returns {Graph}
 */
export function neighbourhood(graph, around, depth) {
    let near = new Set(graph.boxes.filter(one => boxOf({boxes: [one], edges: []}, around))
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
