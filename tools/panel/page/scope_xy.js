// SPDX-License-Identifier: MIT
// Pairs of values of two channels, and the axes on which they are drawn. No drawing.
import {valueAt} from './scope_data.js';
import {nice} from './widget_values.js';

/**
 * The pairs of two channels between two times: a pair for each row of `y`, with the value that `x`
 * has then. Of more than `most` rows, every n-th.
 * @param {import('./scope_data.js').Store} store
 * @param {string} x channel
 * @param {string} y channel
 * @param {number} from s
 * @param {number} to s
 * @param {number} most
 * @returns {[number, number][]} pairs of finite values, the oldest first
 */
export function pairs(store, x, y, from, to, most) {
    const placeX = store.place.get(x), placeY = store.place.get(y);
    if (!placeX || !placeY) return [];
    const [group, column] = placeY, [groupX, columnX] = placeX;
    const begin = group.row(from), end = group.row(to),
          step = Math.max(1, Math.ceil((end - begin) / most));
    /** @type {[number, number][]} */
    const all = [];
    for (let row = begin; row < end; row += step) {
        const across = groupX === group ? group.value(columnX, row) :
                                          valueAt(store, x, group.time(row)),
              up = group.value(column, row);
        if (Number.isFinite(across) && Number.isFinite(up)) all.push([across, up]);
    }
    return all;
}

/**
 * @typedef {object} Axis
 * @property {number} low at the begin of the axis
 * @property {number} high at its end
 * @property {number} step between two lines of the grid
 */

/**
 * An axis that has all values, with a margin. An axis for one value has a span of 1 around it.
 * @param {number} min
 * @param {number} max
 * @param {number} span 0, or the span that the axis has at least
 * @returns {Axis}
 */
export function axis(min, max, span = 0) {
    const own = max > min ? max - min : 1, wide = Math.max(own, span) * 1.1,
          middle = (min + max) / 2;
    return {low: middle - wide / 2, high: middle + wide / 2, step: nice(wide / 6)};
}

const maxRatio = 10;  // of two spans that have one scale

/**
 * The axes of pairs in a picture of this size. With `same`, because both channels have one unit, a
 * unit is as long on both axes, so that a circle looks like one, unless one span is more than ten
 * times the other.
 * @param {[number, number][]} all at least one
 * @param {boolean} same
 * @param {number} width
 * @param {number} height
 * @returns {{x: Axis, y: Axis}}
 */
export function axes(all, same, width, height) {
    let [[left, bottom]] = all, [[right, top]] = all;
    for (const [x, y] of all) {
        left = Math.min(left, x);
        right = Math.max(right, x);
        bottom = Math.min(bottom, y);
        top = Math.max(top, y);
    }
    const wide = right - left, high = top - bottom;
    if (!same || wide > maxRatio * high || high > maxRatio * wide)
        return {x: axis(left, right), y: axis(bottom, top)};
    const perPixel = Math.max(wide / width, high / height);
    return {
        x: axis(left, right, perPixel * width),
        y: axis(bottom, top, perPixel * height)
    };
}

/// The multiples of an axis's step that are on it.
export function ticks({low, high, step}) {
    const first = Math.ceil(low / step), last = Math.floor(high / step);
    return Array.from({length: last - first + 1}, (_, i) => (first + i) * step);
}
