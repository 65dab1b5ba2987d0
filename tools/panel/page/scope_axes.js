// SPDX-License-Identifier: MIT
// The numbers of the scope's axes.

/// A time with a unit.
export function seconds(s) {
    if (s < 1e-3) return `${Number((s * 1e6).toPrecision(4))} µs`;
    if (s < 1) return `${Number((s * 1e3).toPrecision(4))} ms`;
    return `${Number(s.toPrecision(4))} s`;
}

/// Digits behind the decimal point with which steps of `size` differ.
const digits = size => Math.min(9, Math.max(0, 2 - Math.floor(Math.log10(size))));

/// A number on an axis with steps of `size`, without the zeros that no label needs.
export function label(value, size) {
    if (Math.abs(value) < size * 1e-6) return '0';
    if (Math.abs(value) >= 1e6 || size < 1e-6) return value.toExponential(2);
    return String(Number(value.toFixed(digits(size))));
}

/// Whether channels are shown one above the other: numbers at the lines of one of them would be
/// among the traces of the others.
export const isStack = channels => channels.length > 3;

/**
 * The name of a channel in the picture, with what its lines mean where they have no numbers.
 * @param {{name: string, unit?: string, scale: number}} channel
 * @param {unknown[]} channels
 */
export function channelTitle({name, unit, scale}, channels) {
    const whole = unit ? `${name} (${unit})` : name;
    return isStack(channels) ? `${whole}, ${label(scale, scale)} per division` : whole;
}

/**
 * The numbers of a channel at the horizontal lines, from the top.
 * @param {{scale: number, position: number}} channel
 * @param {number} rows lines of the picture
 * @returns {{row: number, text: string}[]}
 */
export function valueLabels({scale, position}, rows) {
    return Array.from({length: rows - 1}, (_, i) => {
        const value = (rows / 2 - (i + 1) - position) * scale;
        return {row: i + 1, text: label(value, scale)};
    });
}

const units = [{limit: 1e-3, factor: 1e6, unit: 'µs'}, {limit: 1, factor: 1e3, unit: 'ms'}];

/**
 * The times at the vertical lines. `zero` is the place of time 0, in divisions from the left.
 * @param {number} base seconds per division
 * @param {number} divisions
 * @param {number} zero
 * @param {number} every the lines that have a label: 1 all of them, 2 every second one …
 * @returns {{at: number, text: string}[]} with the unit in the last one
 */
export function timeLabels(base, divisions, zero, every = 1) {
    const {factor, unit} =
        units.find(({limit}) => base * divisions <= limit) ?? {factor: 1, unit: 's'};
    const last = divisions - every, all = [];
    for (let at = last; at > 0; at -= every) {
        const text = label((at - zero) * base * factor, base * factor);
        all.unshift({at, text: at === last ? `${text} ${unit}` : text});
    }
    return all;
}
