// SPDX-License-Identifier: MIT
// The canvas of the graph: draws boxes and edges, pans and zooms, and reports what was clicked.
// What is too small to read is left out: values first, then ports, and last of all names.
import {colour, number, surface, typeColour} from './dom.js';
import {boxOf, head, line, listHead, listLine} from './graph_model.js';

export const font = '12px system-ui, "DejaVu Sans", sans-serif';

const maxScale = 4, minScale = .03;
const detail = {ports: .3, values: .45};  // from which scale on they are drawn
const minText = 5;                        // px on the screen: smaller names are not drawn
const readable = 11 / 12;  // scale below which the text is smaller than 11 px on the screen
const slack = 8;           // px beside the drawing, and between a finger and what it means
const flight = 400;        // ms
const steps = {
    ArrowLeft: [60, 0],
    ArrowRight: [-60, 0],
    ArrowUp: [0, 60],
    ArrowDown: [0, -60]
};

const stillness = matchMedia('(prefers-reduced-motion: reduce)');

/// The width of a text in the font of the drawing.
export function textMeasure() {
    const context = document.createElement('canvas').getContext('2d');
    context.font = font;
    return text => context.measureText(text).width;
}

/// `back`: the path leaves to the right, turns and runs to the left.
function curve(context, path, back) {
    context.moveTo(...path[0]);
    for (let i = 1; i < path.length; i++) {
        const [x0, y0] = path[i - 1], [x1, y1] = path[i],
                   bend = Math.max(Math.abs(x1 - x0) * .45, 14);
        const begin = back && i > 1 ? -bend : bend,
              end = back && i < path.length - 1 ? -bend : bend;
        context.bezierCurveTo(x0 + begin, y0, x1 - end, y1, x1, y1);
    }
}

/// An edge from top to bottom, or back to the top.
function fall(context, path) {
    context.moveTo(...path[0]);
    for (let i = 1; i < path.length; i++) {
        const [x0, y0] = path[i - 1], [x1, y1] = path[i], bend = (y1 - y0) * .45;
        context.bezierCurveTo(x0, y0 + bend, x1, y1 - bend, x1, y1);
    }
}

/// The head of an arrow at the end of an edge that falls, or rises back.
function arrowHead(context, path, isBack) {
    const [x, y] = path[path.length - 1], tail = isBack ? 7 : -7;
    context.beginPath();
    context.moveTo(x, y);
    context.lineTo(x - 4, y + tail);
    context.lineTo(x + 4, y + tail);
    context.fill();
}

/// A value in the space beside an output.
const shortValue = value =>
    number(typeof value === 'number' ? Number(value.toPrecision(4)) : value);

export class GraphCanvas {
    /**
     * @param {HTMLCanvasElement} canvas
     * @param {object} acts
     * @param {(name: string) => void} acts.select a pin or a box was clicked, or '': nothing
     * @param {(box: string) => void} acts.fold the arrow of a box or of a frame was clicked
     */
    constructor(canvas, acts) {
        this.canvas = canvas;
        this.acts = acts;
        /** @type {import('./graph_model.js').Graph} */
        this.graph = {boxes: [], edges: [], frames: []};
        this.looks = {card: '', back: '', text: '', dim: '', line: '', accent: ''};
        this.flying = 0;  // counts flights: a new one ends the one before
        this.size = {width: 1, height: 1};
        this.isTall = false;  // from top to bottom, for a narrow screen
        this.values = new Map();
        this.selected = '';
        this.signal = '';  // of what is selected
        this.view = {x: 0, y: 0, scale: 1, fitted: false, moved: false, size: ''};
        this.pointers = new Map();
        this.travelled = 0;  // px, since the last pointer went down
        this.surface =
            surface(canvas, (context, width, height) => this.paint(context, width, height));
        this.listen();
    }

    end() { this.surface.end(); }
    request() { this.surface.request(); }

    /// Shows another graph, all of it. `isTall`: from its top on, as wide as the screen.
    show(graph, size, isTall = false) {
        this.graph = graph;
        this.size = size;
        this.isTall = isTall;
        this.view.fitted = false;
        this.request();
    }

    /// How wide a drawing may be, so that its text can be read without moving it sideways.
    readableWidth() {
        const width = this.canvas.clientWidth || innerWidth;
        return (width - 2 * slack) / readable;
    }

    paint(context, width, height) {
        const view = this.view;
        const outdated = !view.fitted || (!view.moved && view.size !== `${width} ${height}`);
        if (outdated && this.graph.boxes.length > 0) {
            if (this.isTall)
                this.begin(width, height);
            else
                this.fit(width, height);
        }
        this.state(view);
        context.translate(view.x, view.y);
        context.scale(view.scale, view.scale);
        context.font = font;
        context.textBaseline = 'middle';
        for (const name of Object.keys(this.looks))
            this.looks[name] = colour(`--${name}`);
        for (const frame of this.graph.frames)
            this.drawFrame(context, frame);
        this.drawEdges(context);
        const left = -view.x / view.scale, top = -view.y / view.scale;
        const right = left + width / view.scale, bottom = top + height / view.scale;
        for (const box of this.graph.boxes)
            if (box.x <= right && box.x + box.width >= left && box.y <= bottom &&
                box.y + box.height >= top)
                this.drawBox(context, box);
        if (view.scale < detail.ports)
            for (const frame of this.graph.frames)
                this.drawFarTitle(context, frame);
    }

    /// States in the page what is shown, for tests.
    state({x, y, scale}) {
        const shown = [x, y, scale].map(value => value.toFixed(3)).join(' ');
        if (this.canvas.dataset.view !== shown) this.canvas.dataset.view = shown;
    }

    drawEdges(context) {
        const thin = Math.max(1.3, .6 / this.view.scale);  // px: visible at every scale
        const bundles = this.graph.edges.filter(edge => edge.bundle);
        for (const edge of this.graph.edges) {
            const marked = edge.signals.some(signal => signal.name === this.signal);
            const dashed = edge.back || edge.loop, wide = 1 + Math.log2(edge.signals.length);
            context.strokeStyle = edge.type ? typeColour(edge.type) : this.looks.dim;
            context.lineWidth = marked ? 3 * wide : thin * wide;
            context.globalAlpha = this.signal && !marked ? .35 : .85;
            context.setLineDash(dashed ? [5, 4] : []);
            context.beginPath();
            if (edge.vertical)
                fall(context, edge.path);
            else
                curve(context, edge.path, dashed);
            context.stroke();
            if (!edge.vertical) continue;
            context.fillStyle = context.strokeStyle;
            arrowHead(context, edge.path, edge.back);
        }
        context.globalAlpha = 1;
        context.setLineDash([]);
        if (this.view.scale < detail.ports) return;
        for (const {signals, path, vertical, back} of bundles) {
            const [x, y] = path[0], down = back ? -10 : 11;
            const at = vertical ? [x - 2, y + down] : [x, y - 9];
            if (signals.length > 1) this.drawCount(context, signals.length, at);
        }
    }

    /**
     * The number of signals of a bundle, beside its begin.
     * @param {CanvasRenderingContext2D} context
     * @param {number} count
     * @param {number[]} at
     */
    drawCount(context, count, [x, y]) {
        context.fillStyle = this.looks.text;
        context.fillText(String(count), x + 6, y);
    }

    /// A title in a space of this width: as large as on the screen, as far as it fits. Not drawn
    /// when it would be too small.
    drawTitle(context, text, x, y, width, height) {
        const {scale} = this.view;
        context.font = 'bold ' + font;
        const natural = 12, fits = natural * width / context.measureText(text).width;
        const size = Math.min(Math.max(natural, natural / scale), fits, height * .9);
        if (size * scale < minText) return;
        context.font = 'bold ' + font.replace(`${natural}px`, `${size}px`);
        context.fillStyle = this.looks.text;
        context.fillText(text, x, y);
        context.font = font;
    }

    /**
     * An open group: the space of its boxes, with its name.
     * @param {any} context
     * @param {any} frame
     */
    drawFrame(context, {x, y, width, height, title, id}) {
        const chosen = id === this.selected;
        context.fillStyle = this.looks.back;
        context.strokeStyle = chosen ? this.looks.accent : this.looks.line;
        context.lineWidth = chosen ? 3 : 1;
        context.beginPath();
        context.roundRect(x, y, width, height, 8);
        context.fill();
        context.stroke();
        if (this.view.scale >= detail.ports)
            this.drawTitle(context, `▾ ${title}`, x + 10, y + 18, width - 20, 32);
    }

    /**
     * The name of an open group across its boxes, which are too small to be read.
     * @param {any} context
     * @param {any} frame
     */
    drawFarTitle(context, {x, y, width, height, title}) {
        context.font = 'bold ' + font;
        const fits = Math.min(12 * width / context.measureText(title).width, height),
              size = Math.min(15 / this.view.scale, .8 * fits);
        context.font = 'bold ' + font.replace('12px', `${size}px`);
        context.textAlign = 'center';
        context.lineJoin = 'round';
        context.lineWidth = size / 3;
        context.strokeStyle = this.looks.back;
        context.strokeText(title, x + width / 2, y + height / 2);
        context.fillStyle = this.looks.text;
        context.fillText(title, x + width / 2, y + height / 2);
        context.textAlign = 'left';
        context.font = font;
    }

    drawBox(context, box) {
        const chosen = box.id === this.selected, {scale} = this.view;
        context.fillStyle = this.looks.card;
        context.strokeStyle = chosen ? this.looks.accent : this.looks.dim;
        context.lineWidth = chosen ? 3 : 1;
        context.beginPath();
        context.roundRect(box.x, box.y, box.width, box.height, 5);
        context.fill();
        context.stroke();
        if (box.members) return this.drawGroup(context, box);
        if (scale < detail.ports) {
            const {title, x, y, width, height} = box;
            return this.drawTitle(context, title, x + 6, y + height / 2, width - 12, height);
        }
        context.fillStyle = this.looks.text;
        context.font = 'bold ' + font;
        const title = `${box.collapsed ? '▸' : '▾'} ${box.title}`;
        context.fillText(title, box.x + 6, box.y + (box.isList ? listHead : head) / 2);
        context.font = font;
        if (box.collapsed) return;
        if (box.isList) return this.drawList(context, box);
        for (const port of box.ports.values())
            this.drawPort(context, box, port);
    }

    /// A group that is folded: a second edge looks like boxes behind it.
    drawGroup(context, {x, y, width, height, title, members}) {
        const isSmall = this.view.scale < detail.ports;
        context.fillStyle = this.looks.dim;
        context.fillRect(x + 5, y + height + 2, width - 10, 1.5);
        context.fillRect(x + 10, y + height + 5, width - 20, 1.5);
        if (isSmall) return this.drawTitle(context, title, x + 8, y + height / 2, width - 16, 40);
        this.drawTitle(context, `▸ ${title}`, x + 8, y + 16, width - 16, 20);
        context.fillStyle = this.looks.dim;
        const count = members.size === 1 ? '1 instance' : `${members.size} instances`;
        context.fillText(count, x + 22, y + 33);
    }

    /// Ports below each other: inputs at the left edge, outputs at the right, and values.
    drawList(context, box) {
        for (const {pin, label, y: down, input} of box.ports.values()) {
            const y = box.y + down, right = box.x + box.width;
            context.fillStyle = typeColour(pin.type);
            context.beginPath();
            context.arc(input ? box.x : right, y, pin.name === this.selected ? 5 : 3, 0, 7);
            context.fill();
            context.fillStyle = this.looks.text;
            context.fillText(label, box.x + 8, y);
            const value = this.values.get(pin.signal);
            if (value === undefined) continue;
            context.fillStyle = this.looks.dim;
            context.textAlign = 'right';
            context.fillText(shortValue(value), right - 9, y);
            context.textAlign = 'left';
        }
    }

    drawPort(context, box, port) {
        const y = box.y + port.y, x = port.input ? box.x : box.x + box.width;
        context.fillStyle = typeColour(port.pin.type);
        context.beginPath();
        context.arc(x, y, port.pin.name === this.selected ? 5 : 3, 0, 7);
        context.fill();
        context.fillStyle = this.looks.text;
        context.textAlign = port.input ? 'left' : 'right';
        context.fillText(port.label, port.input ? x + 8 : x - 8, y);
        context.textAlign = 'left';
        const value = this.values.get(port.pin.signal);
        if (port.input || value === undefined || this.view.scale < detail.values)
            return;
        context.lineWidth = 3;
        context.lineJoin = 'round';
        context.strokeStyle = this.looks.card;  // keeps the value legible above an edge
        context.strokeText(shortValue(value), x + 6, y - 7);
        context.fillStyle = this.looks.dim;
        context.fillText(shortValue(value), x + 6, y - 7);
    }

    /// Shows everything.
    fit(width = this.canvas.clientWidth, height = this.canvas.clientHeight) {
        const view = this.view, size = this.size;
        view.scale = Math.min(1.2, (width - 40) / (size.width + 60), (height - 40) / size.height);
        view.x = (width - size.width * view.scale) / 2;
        view.y = (height - size.height * view.scale) / 2;
        Object.assign(view, {fitted: true, moved: false, size: `${width} ${height}`});
        this.request();
    }

    /// Shows the top of a drawing, as wide as the screen and large enough to be read.
    begin(width, height) {
        const {view, size} = this, wide = width - 2 * slack;
        view.scale = Math.max(readable, Math.min(1.2, wide / size.width));
        view.x = Math.max(slack, (width - size.width * view.scale) / 2);
        view.y = Math.max(2 * slack, (height - size.height * view.scale) / 2);
        Object.assign(view, {fitted: true, moved: false, size: `${width} ${height}`});
    }

    zoom(factor, x, y) {
        const view = this.view,
              scale = Math.min(maxScale, Math.max(minScale, view.scale * factor));
        view.x = x - (x - view.x) * scale / view.scale;
        view.y = y - (y - view.y) * scale / view.scale;
        view.scale = scale;
        view.moved = true;
        this.request();
    }

    pan(x, y) {
        this.view.x += x;
        this.view.y += y;
        this.view.moved = true;
        this.request();
    }

    /// The box or the frame of a name.
    placeOf(name) {
        return this.graph.frames.find(one => one.id === name) ?? boxOf(this.graph, name);
    }

    /// Flies to the box of a name, or to its frame.
    centre(name) {
        const place = this.placeOf(name), {view, canvas} = this;
        if (!place) return;
        const {clientWidth: width, clientHeight: height} = canvas;
        const fits = Math.min(width / (place.width + 60), height / (place.height + 60)),
              near = Math.min(Math.max(view.scale, .8), Math.max(fits, minScale)),
              scale = this.isTall ? Math.max(near, readable) : near;
        const isWhole = this.isTall && this.size.width * scale <= width;
        const x = isWhole ? this.size.width / 2 : place.x + place.width / 2,
              y = place.y + place.height / 2;
        view.fitted = view.moved = true;
        if (stillness.matches) return this.look(x, y, scale);
        const from = {
            x: (width / 2 - view.x) / view.scale,
            y: (height * this.middle() - view.y) / view.scale,
            scale: view.scale
        };
        this.fly(from, {x, y, scale});
    }

    /// Where a place that is looked at is, from the top: the details cover the lower half of a tall
    /// drawing.
    middle() { return this.isTall ? .27 : .5; }

    /// Moves from one place to another within 400 ms.
    fly(from, to) {
        const number = ++this.flying, start = performance.now();
        const step = () => {
            if (number !== this.flying || !this.canvas.isConnected) return;
            const passed = Math.min(1, (performance.now() - start) / flight),
                  share = passed * passed * (3 - 2 * passed);
            this.look(
                from.x + (to.x - from.x) * share, from.y + (to.y - from.y) * share,
                from.scale * (to.scale / from.scale) ** share);
            if (passed < 1) requestAnimationFrame(step);
        };
        step();
    }

    /// Shows a place of the drawing in the middle.
    look(x, y, scale) {
        Object.assign(this.view, {
            scale,
            x: this.canvas.clientWidth / 2 - x * scale,
            y: this.canvas.clientHeight * this.middle() - y * scale
        });
        this.request();
    }

    /// What is at a place of the canvas: a pin, a box, the arrow of a box, or null.
    hit(x, y) {
        const {view} = this, gx = (x - view.x) / view.scale, gy = (y - view.y) / view.scale;
        const near = this.isTall ? slack : 0;
        const box = this.graph.boxes.find(
            one => gx >= one.x - 8 && gx <= one.x + one.width + 8 && gy >= one.y - near &&
                gy <= one.y + one.height + near);
        if (!box) return this.hitFrame(gx, gy);
        if (box.isList) return this.hitList(box, gx, gy);
        if (box.members) return {box: box.id, arrow: gx < box.x + 20 && gy < box.y + head};
        const onPorts = !box.collapsed && gy > box.y + head, left = gx < box.x + box.width / 2;
        const port = [...box.ports.values()].find(
            one => Math.abs(gy - box.y - one.y) < line / 2 && one.input === left);
        if (onPorts && port) return {pin: port.pin.name};
        return {box: box.id, arrow: gx < box.x + 20};
    }

    /// The same in a box on a narrow screen, where a finger needs more space.
    hitList(box, x, y) {
        const foldable = box.members ? box.height : listHead, isHead = y < box.y + foldable;
        if (isHead || box.collapsed) return {box: box.id, arrow: x < box.x + 32};
        const port = [...box.ports.values()].find(
            one => Math.abs(y - box.y - one.y) <= listLine / 2);
        return port ? {pin: port.pin.name} : {box: box.id, arrow: false};
    }

    hitFrame(x, y) {
        const frame = this.graph.frames.find(
            one => x >= one.x && x <= one.x + one.width && y >= one.y && y <= one.y + 36);
        return frame ? {box: frame.id, arrow: x < frame.x + 26} : null;
    }

    listen() {
        const {canvas} = this;
        canvas.addEventListener('pointerdown', event => this.pressed(event));
        canvas.addEventListener('pointermove', event => this.dragged(event));
        canvas.addEventListener('pointerup', event => this.released(event));
        canvas.addEventListener('pointercancel', event => this.released(event));
        canvas.addEventListener('keydown', event => this.typed(event));
        canvas.addEventListener('wheel', event => {
            event.preventDefault();
            this.zoom(Math.exp(-event.deltaY / 400), event.offsetX, event.offsetY);
        }, {passive: false});
    }

    pressed(event) {
        this.flying++;
        this.pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
        this.travelled = 0;
        this.canvas.setPointerCapture(event.pointerId);
    }

    dragged(event) {
        const before = this.pointers.get(event.pointerId);
        if (!before) return;
        const now = [event.offsetX, event.offsetY];
        this.travelled += Math.abs(now[0] - before[0]) + Math.abs(now[1] - before[1]);
        if (this.pointers.size === 2)
            this.pinched(event.pointerId, before, now);
        else
            this.pan(now[0] - before[0], now[1] - before[1]);
        this.pointers.set(event.pointerId, now);
    }

    /// Two fingers: zooms around the other one.
    pinched(id, before, now) {
        const [other] = [...this.pointers].filter(([one]) => one !== id).map(([, at]) => at);
        const distance = at => Math.hypot(at[0] - other[0], at[1] - other[1]);
        this.zoom(distance(now) / Math.max(distance(before), 1), other[0], other[1]);
    }

    released(event) {
        const known = this.pointers.delete(event.pointerId);
        if (!known || this.travelled > 6 || event.type === 'pointercancel') return;
        const found = this.hit(event.offsetX, event.offsetY);
        if (found?.arrow)
            this.acts.fold(found.box);
        else
            this.acts.select(found?.pin ?? found?.box ?? '');
    }

    typed(event) {
        const step = steps[event.key], {clientWidth, clientHeight} = this.canvas;
        if (step)
            this.pan(step[0], step[1]);
        else if (event.key === '+' || event.key === '-')
            this.zoom(event.key === '+' ? 1.25 : .8, clientWidth / 2, clientHeight / 2);
        else if (event.key === '0')
            this.fit();
        else if (event.key === 'Escape')
            this.acts.select('');
        else
            return;
        event.preventDefault();
    }
}
