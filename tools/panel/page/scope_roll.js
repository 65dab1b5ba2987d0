// SPDX-License-Identifier: MIT
// Traces that move to the left: those of the last picture are moved, and only the columns that are
// new, or were not complete, are drawn.

/**
 * A trace with many samples in each column of pixels.
 * @typedef {object} RolledTrace
 * @property {any} columns Columns of scope_data.js, up to date
 * @property {number} zero the row of the value 0
 * @property {number} perUnit rows for each unit
 * @property {{name: string, thick: number, dashed: boolean}} line
 */

/**
 * What the rows of a picture have behind the traces.
 * @typedef {object} Back
 * @property {string} key what it depends on
 * @property {Uint32Array} rows the colour of each row
 * @property {Uint8Array} isLine of each row: a line from side to side, which covers the ground
 */

export class Roll {
    constructor() {
        this.key = '';
        this.layer = new Uint32Array(0);
        this.first = 0;    // the interval of the first column
        this.settled = 0;  // the first interval that was not complete
        this.drawn = 0;    // columns of the last picture that were drawn
    }

    /// The next picture is drawn as a whole.
    forget() { this.key = ''; }

    /**
     * Puts traces into a picture whose ground is drawn.
     * @param {import('./scope_picture.js').Picture} picture
     * @param {RolledTrace[]} traces the first one is behind the others
     * @param {number} first the interval of the first column
     * @param {Back} back
     */
    put(picture, traces, first, back) {
        const {width, height, pixels} = picture, {rows} = back;
        const looks = traces.map(({columns, zero, perUnit, line: {name, thick, dashed}}) => [
            columns.number, zero, perUnit, name, thick, dashed
        ]);
        const key = [width, height, back.key, ...looks.flat()].join(' ');
        const shift = first - this.first, isSame = key === this.key && shift >= 0 && shift < width;
        const begin = isSame ? Math.max(0, Math.min(width - shift, this.settled - first)) : 0;
        if (this.layer.length !== pixels.length) this.layer = new Uint32Array(pixels.length);
        const {layer} = this;
        if (shift > 0 && begin > 0) layer.copyWithin(0, shift);
        for (let y = 0; y < height; y++)
            layer.fill(rows[y], y * width + begin, (y + 1) * width);
        for (const {columns, zero, perUnit, line} of traces)
            picture.columnsInto(layer, columns, first, begin, zero, perUnit, line);
        Object.assign(this, {key, first, drawn: width - begin});
        this.settled = Math.min(first + width, ...traces.map(({columns}) => columns.newest));
        this.compose(picture, back);
    }

    /// Puts the layer above the ground, of which it covers what its traces and lines need.
    compose({width, height, pixels, ground}, {rows, isLine}) {
        const {layer} = this, back = rows[0];
        const special = [];  // columns of the ground that are not as all others
        for (let x = 0; x < width; x++)
            if (ground[x] !== back) special.push(x);
        pixels.set(layer);
        for (let y = 0; y < height; y++) {
            if (isLine[y] === 1) continue;
            const plain = rows[y], start = y * width;
            for (const x of special)
                if (layer[start + x] === plain) pixels[start + x] = ground[start + x];
        }
    }
}
