// SPDX-License-Identifier: MIT
// What the scope shows, as files: a table and a picture.

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

/// Offers a file for download.
export function download(name, blob) {
    const link = document.createElement('a');
    link.href = URL.createObjectURL(blob);
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}
