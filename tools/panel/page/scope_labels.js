// SPDX-License-Identifier: MIT
// Texts on the picture of the scope. Most of them stay the same for many frames, so they are drawn
// once, and their pixels are copied into each picture: without a GPU, text costs more than traces.

/**
 * @typedef {object} Label
 * @property {string} text
 * @property {number} x CSS pixels
 * @property {number} y CSS pixels, of the base line
 * @property {string} paint
 * @property {string} [font]
 */

const usual = '12px system-ui, sans-serif';

/// Returns the text, or as much of its beginning as fits `width`, and an ellipsis.
export function fitted(context, text, width, font = usual) {
    context.font = font;
    if (context.measureText(text).width <= width) return text;
    let size = text.length;
    while (size > 0 && context.measureText(`${text.slice(0, size)}…`).width > width)
        size--;
    return `${text.slice(0, size)}…`;
}

/// Draws a label with a margin in the colour `back`, kept within `width`.
export function write(context, {text, x, y, paint, font = usual}, back, width) {
    context.font = font;
    const wide = context.measureText(text).width, left = Math.max(2, Math.min(x, width - wide - 4));
    context.lineJoin = 'round';
    context.lineWidth = 3;
    context.strokeStyle = back;
    context.strokeText(text, left, y);
    context.fillStyle = paint;
    context.fillText(text, left, y);
}

export class Labels {
    constructor() {
        this.key = '';
        this.places = new Uint32Array(0);
        this.colours = new Uint32Array(0);
    }

    /// Whether the labels of this key are those that were put last.
    has(key) { return key === this.key; }

    /**
     * Puts labels into a picture.
     * @param {import('./scope_picture.js').Picture} picture
     * @param {string} key what the labels depend on
     * @param {Label[]} labels not used when the labels of this key were put last
     * @param {string} back
     * @param {number} ratio device pixels per CSS pixel
     */
    put(picture, key, labels, back, ratio) {
        const {width, height} = picture;
        if (!this.has(key)) this.draw(width, height, labels, back, ratio);
        this.key = key;
        const {places, colours} = this, {pixels} = picture;
        for (let i = 0; i < places.length; i++)
            pixels[places[i]] = colours[i];
    }

    draw(width, height, labels, back, ratio) {
        const canvas = document.createElement('canvas');
        Object.assign(canvas, {width, height});
        const context = canvas.getContext('2d', {willReadFrequently: true});
        context.scale(ratio, ratio);
        for (const label of labels)
            write(context, label, back, width / ratio);
        const all = new Uint32Array(context.getImageData(0, 0, width, height).data.buffer);
        this.places = Uint32Array.from(all.keys()).filter(place => all[place] >>> 24 > 127);
        this.colours = this.places.map(place => (all[place] | 0xff000000) >>> 0);
    }
}
