// SPDX-License-Identifier: MIT
// What the scope shows, as files: a table and a picture.
import {seconds} from './scope_axes.js';

/// A name as a field of a CSV file (RFC 4180).
const field = name => /[",\n]/.test(name) ? `"${name.replaceAll('"', '""')}"` : name;

/**
 * The samples between two times as a CSV file with the columns of `hal record`: `time_s`, then each
 * channel. Values of other threads at that time are empty. Times begin at 0.
 * @param {import('./scope_data.js').Store} store
 * @param {string[]} names
 * @param {number} from s
 * @param {number} to s
 * @returns {string}
 */
export function csv(store, names, from, to) {
    const shown = names.filter(name => store.place.has(name));
    const groups = new Map();  // group -> the cells of its columns
    shown.forEach((name, cell) => {
        const [group, column] = store.place.get(name);
        if (!groups.has(group)) groups.set(group, []);
        groups.get(group).push({cell, column});
    });
    const rows = [];
    for (const [group, cells] of groups)
        for (let row = group.row(from); row < group.count && group.time(row) <= to; row++) {
            const values = shown.map(() => '');
            for (const {cell, column} of cells)
                values[cell] = String(group.value(column, row));
            rows.push({time: group.time(row), values});
        }
    rows.sort((a, b) => a.time - b.time);
    const start = rows[0]?.time ?? 0;
    const lines = rows.map(({time, values}) => [(time - start).toFixed(9), ...values].join(','));
    return [['time_s', ...shown.map(field)].join(','), ...lines, ''].join('\n');
}

/**
 * What a file of the samples between two times will not have, because only their minima and maxima
 * are kept.
 * @param {import('./scope_data.js').Store} store
 * @param {string[]} names
 * @param {number} from s
 * @param {number} to s
 * @param {string} where what ends at `to`, as ' of the picture'; '': all that is kept
 * @returns {{isEmpty: boolean, problem: string}} isEmpty: there would be no samples in it
 */
export function overwritten(store, names, from, to, where = '') {
    const shown = names.filter(name => store.place.has(name)),
          late = shown.filter(name => store.isCoarse(name, from));
    const firstOf = name => {
        const [group] = store.place.get(name);
        return group.time(group.first);
    };
    const firsts = [...new Set(late.map(firstOf))];  // one of each thread
    if (firsts.length === 0) return {isEmpty: false, problem: ''};
    if (late.length === shown.length && firsts.every(first => first > to)) {
        const kept = seconds(store.newest - Math.min(...firsts));
        const problem =
            'no file is saved: only minima and maxima of this time are kept; scroll to ' +
            `the last ${kept}, whose samples are kept`;
        return {isEmpty: true, problem};
    }
    const isOfAll = firsts.length === 1 && late.length === shown.length;
    const parts = firsts.map(first => {
        const of = isOfAll ? '' : ` of ${late.filter(name => firstOf(name) === first).join(', ')}`;
        return first > to ? `no samples${of}` : `the last ${seconds(to - first)}${where}${of}`;
    });
    const problem = `the file has ${parts.join(' and ')}: ` +
        'only minima and maxima of earlier samples are kept';
    return {isEmpty: false, problem};
}

/// Offers a file for download.
export function download(name, blob) {
    const link = document.createElement('a');
    link.href = URL.createObjectURL(blob);
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}
