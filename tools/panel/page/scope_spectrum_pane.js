// SPDX-License-Identifier: MIT
// The amplitude spectrum below the traces of the scope: of the selected channel, in dB below its
// largest line, over a logarithmic axis of frequencies.
import {colour, h, number, surface} from './dom.js';
import {fitted, write} from './scope_labels.js';

const range = 100, lines = 5;  // dB; of the grid
const labelWidth = 60;         // px

const figure = value => number(Number(value.toPrecision(4)));

/// 1, 2, 5, 10, … Hz, as far as they are between two frequencies.
function roundFrequencies(low, high) {
    const all = [];
    for (let decade = 10 ** Math.floor(Math.log10(low)); decade < high; decade *= 10)
        all.push(decade, 2 * decade, 5 * decade);
    return all.filter(frequency => frequency > low && frequency < high);
}

export class SpectrumPane {
    constructor() {
        this.canvas =
            h('canvas', {role: 'img', 'aria-label': 'Amplitude spectrum of the selected channel'});
        this.element = h('div', {class: 'fill spectrum'}, this.canvas);
        this.surface =
            surface(this.canvas, (context, width, height) => this.paint(context, width, height));
        this.title = '';
        this.tone = '';
        /** @type {ReturnType<typeof import('./scope_spectrum.js').spectrum>} */
        this.found = null;
    }

    /// Shows a spectrum; null: there is none.
    show(found, name, unit, tone) {
        const peak = found?.peak;
        const amplitude = peak && `${figure(peak.amplitude)}${unit ? ` ${unit}` : ''}`;
        Object.assign(this, {
            found,
            tone,
            title: peak ? `${name}: ${figure(peak.frequency)} Hz, ${amplitude}` :
                          `${name}: no spectrum: too few samples, or no change`
        });
        this.surface.request();
    }

    end() { this.surface.end(); }

    /// The place of line `k` of the spectrum.
    placeOf(k, width) { return width * Math.log(k) / Math.log(this.found.amplitudes.length); }

    paint(context, width, height) {
        const [grid, dim, back] = ['--line', '--dim', '--card'].map(colour);
        const label = (text, x, y, paint) => write(context, {text, x, y, paint}, back, width);
        context.fillStyle = grid;
        for (let i = 1; i < lines; i++)
            context.fillRect(0, Math.round(height * i / lines), width, 1);
        if (this.found) this.paintFrequencies(context, width, height, label);
        if (this.found?.peak) this.paintLines(context, width, height);
        for (let i = 1; i < lines; i++)
            label(`-${range * i / lines} dB`, 4, height * i / lines - 4, dim);
        label(fitted(context, this.title, width - 18), 14, 14, this.tone);
    }

    paintFrequencies(context, width, height, label) {
        const {step, amplitudes} = this.found, dim = colour('--dim');
        let free = labelWidth;  // the next label begins here at the earliest
        for (const frequency of roundFrequencies(step, step * amplitudes.length)) {
            const x = this.placeOf(frequency / step, width);
            context.fillStyle = colour('--line');  // a label has another one
            context.fillRect(Math.round(x), 0, 1, height);
            if (x < free || x > width - labelWidth) continue;
            label(`${figure(frequency)} Hz`, x + 4, height - 5, dim);
            free = x + labelWidth;
        }
    }

    /// The largest line of each column.
    paintLines(context, width, height) {
        const {amplitudes, peak} = this.found, count = amplitudes.length;
        context.strokeStyle = this.tone;
        context.lineWidth = 1.5;
        context.beginPath();
        let column = 0, largest = 0;
        const add = () => {
            const level = 20 * Math.log10(largest / peak.amplitude || 1e-30);
            context.lineTo(column, Math.min(height, -level * height / range));
        };
        for (let k = 1; k < count; k++) {
            const x = Math.round(this.placeOf(k, width));
            if (x !== column) {
                add();
                largest = 0;
            }
            column = x;
            largest = Math.max(largest, amplitudes[k]);
        }
        add();
        context.stroke();
    }
}
