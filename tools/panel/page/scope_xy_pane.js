// SPDX-License-Identifier: MIT
// The values of the selected channel over those of another one, beside the traces of the scope.
// The newest pair has a dot.
import {colour, h, surface} from './dom.js';
import {label} from './scope_axes.js';
import {write} from './scope_labels.js';
import {axes, pairs, ticks} from './scope_xy.js';

const maxPairs = 4000;
const minPeriod = 100;  // ms between two pictures

/// A channel with its unit.
const titled = ({name, unit}) => unit ? `${name} (${unit})` : name;

export class XyPane {
    constructor() {
        this.canvas = h('canvas', {
            role: 'img',
            'aria-label': 'Values of the selected channel over those of another one'
        });
        this.element = h('div', {class: 'fill xy'}, this.canvas);
        this.surface =
            surface(this.canvas, (context, width, height) => this.paint(context, width, height));
        this.pairs = [];
        this.x = this.y = {name: '', unit: ''};
        this.tone = '';
        this.drawnAt = 0;
    }

    end() { this.surface.end(); }

    /// Shows two channels between two times, at most every 100 ms unless it is `forced`.
    show(store, x, y, [from, to], tone, forced) {
        const now = performance.now();
        if (!forced && now - this.drawnAt < minPeriod) return;
        this.drawnAt = now;
        Object.assign(this, {x, y, tone, pairs: pairs(store, x.name, y.name, from, to, maxPairs)});
        this.surface.request();
    }

    paint(context, width, height) {
        const back = colour('--card'), dim = colour('--dim');
        const put = (text, x, y, paint) => write(context, {text, x, y, paint}, back, width);
        if (this.pairs.length === 0) {
            put(`${this.y.name} over ${this.x.name}: no samples`, 14, 16, dim);
            return;
        }
        const same = this.x.unit === this.y.unit;
        const {x, y} = axes(this.pairs, same, width, height);
        const across = value => width * (value - x.low) / (x.high - x.low),
              down = value => height * (y.high - value) / (y.high - y.low);
        context.fillStyle = colour('--grid');
        for (const value of ticks(x))
            context.fillRect(Math.round(across(value)), 0, 1, height);
        for (const value of ticks(y))
            context.fillRect(0, Math.round(down(value)), width, 1);
        this.paintPairs(context, across, down);
        for (const value of ticks(x))
            put(label(value, x.step), across(value) + 4, height - 5, dim);
        for (const value of ticks(y))
            if (down(value) > 30 && down(value) < height - 24)
                put(label(value, y.step), 4, down(value) - 4, this.tone);
        put(titled(this.y), 4, 14, this.tone);
        const name = titled(this.x);
        put(name, width - context.measureText(name).width - 6, height - 20, dim);
    }

    paintPairs(context, across, down) {
        context.strokeStyle = context.fillStyle = this.tone;
        context.lineWidth = 1.3;
        context.lineJoin = 'round';
        context.beginPath();
        for (const [x, y] of this.pairs)
            context.lineTo(across(x), down(y));
        context.stroke();
        const [x, y] = this.pairs[this.pairs.length - 1];
        context.beginPath();
        context.arc(across(x), down(y), 4, 0, 7);
        context.fill();
    }
}
