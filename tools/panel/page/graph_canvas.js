// SPDX-License-Identifier: MIT
// The canvas of the graph: draws boxes and edges, pans and zooms, and reports what was clicked.
import {colour, number, surface, typeColour} from './dom.js';
import {boxOf, head, line} from './graph_model.js';

export const font = '12px system-ui, "DejaVu Sans", sans-serif';

const maxScale = 4, minScale = .03;
const steps = {
    ArrowLeft: [60, 0],
    ArrowRight: [-60, 0],
    ArrowUp: [0, 60],
    ArrowDown: [0, -60]
};

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

/// A value in the space beside an output.
const shortValue = value =>
    number(typeof value === 'number' ? Number(value.toPrecision(4)) : value);

export class GraphCanvas {
    /**
     * @param {HTMLCanvasElement} canvas
     * @param {object} acts
     * @param {(name: string) => void} acts.select a pin or a box was clicked, or '': nothing
     * @param {(box: string) => void} acts.fold the arrow of a box was clicked
     */
    constructor(canvas, acts) {
        this.canvas = canvas;
        this.acts = acts;
        /** @type {import('./graph_model.js').Graph} */
        this.graph = {boxes: [], edges: []};
        this.size = {width: 1, height: 1};
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

    /// Shows another graph, all of it.
    show(graph, size) {
        this.graph = graph;
        this.size = size;
        this.view.fitted = false;
        this.request();
    }

    paint(context, width, height) {
        const view = this.view;
        const outdated = !view.fitted || (!view.moved && view.size !== `${width} ${height}`);
        if (outdated && this.graph.boxes.length > 0) this.fit(width, height);
        context.translate(view.x, view.y);
        context.scale(view.scale, view.scale);
        context.font = font;
        context.textBaseline = 'middle';
        this.drawEdges(context);
        const left = -view.x / view.scale, top = -view.y / view.scale;
        const right = left + width / view.scale, bottom = top + height / view.scale;
        for (const box of this.graph.boxes)
            if (box.x <= right && box.x + box.width >= left && box.y <= bottom &&
                box.y + box.height >= top)
                this.drawBox(context, box);
    }

    drawEdges(context) {
        for (const edge of this.graph.edges) {
            const marked = edge.signal.name === this.signal, dashed = edge.back || edge.loop;
            context.strokeStyle = typeColour(edge.signal.type);
            context.lineWidth = marked ? 3 : 1.3;
            context.globalAlpha = this.signal && !marked ? .35 : 1;
            context.setLineDash(dashed ? [5, 4] : []);
            context.beginPath();
            curve(context, edge.path, dashed);
            context.stroke();
        }
        context.globalAlpha = 1;
        context.setLineDash([]);
    }

    drawBox(context, box) {
        const chosen = box.id === this.selected;
        context.fillStyle = colour('--card');
        context.strokeStyle = chosen ? colour('--accent') : colour('--dim');
        context.lineWidth = chosen ? 3 : 1;
        context.beginPath();
        context.roundRect(box.x, box.y, box.width, box.height, 5);
        context.fill();
        context.stroke();
        if (this.view.scale < .25) return;
        context.fillStyle = colour('--text');
        context.font = 'bold ' + font;
        context.fillText(`${box.collapsed ? '▸' : '▾'} ${box.id}`, box.x + 6, box.y + head / 2);
        context.font = font;
        if (box.collapsed) return;
        for (const port of box.ports.values())
            this.drawPort(context, box, port);
    }

    drawPort(context, box, port) {
        const y = box.y + port.y, x = port.input ? box.x : box.x + box.width;
        context.fillStyle = typeColour(port.pin.type);
        context.beginPath();
        context.arc(x, y, port.pin.name === this.selected ? 5 : 3, 0, 7);
        context.fill();
        context.fillStyle = colour('--text');
        context.textAlign = port.input ? 'left' : 'right';
        context.fillText(port.label, port.input ? x + 8 : x - 8, y);
        context.textAlign = 'left';
        const value = this.values.get(port.pin.signal);
        if (port.input || value === undefined || this.view.scale < .45) return;
        context.fillStyle = colour('--dim');
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

    /// Moves the box of a name to the middle.
    centre(name) {
        const box = boxOf(this.graph, name), view = this.view;
        if (!box) return;
        view.scale = Math.max(view.scale, .8);
        view.x = this.canvas.clientWidth / 2 - (box.x + box.width / 2) * view.scale;
        view.y = this.canvas.clientHeight / 2 - (box.y + box.height / 2) * view.scale;
        view.fitted = view.moved = true;
        this.request();
    }

    /// What is at a place of the canvas: a pin, a box, the arrow of a box, or null.
    hit(x, y) {
        const {view} = this, gx = (x - view.x) / view.scale, gy = (y - view.y) / view.scale;
        const box = this.graph.boxes.find(
            one => gx >= one.x - 8 && gx <= one.x + one.width + 8 && gy >= one.y &&
                gy <= one.y + one.height);
        if (!box) return null;
        const onPorts = !box.collapsed && gy > box.y + head, left = gx < box.x + box.width / 2;
        const port = [...box.ports.values()].find(
            one => Math.abs(gy - box.y - one.y) < line / 2 && one.input === left);
        if (onPorts && port) return {pin: port.pin.name};
        return {box: box.id, arrow: gx < box.x + 20};
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
