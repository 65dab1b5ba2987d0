// SPDX-License-Identifier: MIT
// Names of the machine: their order, and what was probably meant by one that does not exist.

/// The parts of a name that are compared: numbers, and single characters.
const parts = name => name.match(/\d+|\D/g) ?? [];

/// Compares the digits of two numbers of any length.
function compareDigits(a, b) {
    const one = a.replace(/^0+/, ''), other = b.replace(/^0+/, '');
    if (one.length !== other.length) return one.length - other.length;
    return compareText(one, other);
}

function compareText(a, b) {
    if (a === b) return 0;
    return a < b ? -1 : 1;
}

const isNumber = part => part !== undefined && part >= '0' && part[0] <= '9';

/**
 * Compares names for sort(): axis2 before axis10. Only equal names are equal. The runtime has the
 * same order (runtime/text/natural_order.hpp).
 * @param {string} a
 * @param {string} b
 */
export function compareNames(a, b) {
    const left = parts(a), right = parts(b), count = Math.min(left.length, right.length);
    for (let i = 0; i < count; i++) {
        const bothNumbers = isNumber(left[i]) && isNumber(right[i]);
        const order =
            bothNumbers ? compareDigits(left[i], right[i]) : compareText(left[i], right[i]);
        if (order !== 0) return order;
    }
    return left.length - right.length || compareText(a, b);
}

/// The edit distance of two words, in which swapped neighbours count once; `limit + 1` when it is
/// larger than the limit.
function distance(a, b, limit) {
    if (Math.abs(a.length - b.length) > limit) return limit + 1;
    let older = [], old = Array.from({length: b.length + 1}, (_, k) => k);
    for (let i = 1; i <= a.length; i++) {
        const row = [i];
        for (let k = 1; k <= b.length; k++) {
            const same = a[i - 1] === b[k - 1];
            row[k] = Math.min(old[k] + 1, row[k - 1] + 1, old[k - 1] + (same ? 0 : 1));
            if (i > 1 && k > 1 && a[i - 1] === b[k - 2] && a[i - 2] === b[k - 1])
                row[k] = Math.min(row[k], older[k - 2] + 1);
        }
        if (Math.min(...row) > limit) return limit + 1;
        older = old;
        old = row;
    }
    return old[b.length];
}

/// A name without what is easily confused: case and separators.
const folded = name => name.toLowerCase().replace(/[-_.]/g, '.');

/**
 * Returns the names that were probably meant, best first.
 * @param {string} name
 * @param {Iterable<string>} all
 * @param {number} [most]
 * @returns {string[]}
 */
export function similar(name, all, most = 3) {
    const typed = folded(name), limit = Math.max(1, Math.floor(typed.length / 3)), found = [];
    if (typed === '') return [];
    for (const candidate of all) {
        const other = folded(candidate), part = typed.length > 2 && other.includes(typed);
        const cost = part ? .5 : distance(typed, other, limit);
        if (cost <= limit) found.push({candidate, cost});
    }
    found.sort((a, b) => a.cost - b.cost || compareNames(a.candidate, b.candidate));
    return found.slice(0, most).map(one => one.candidate);
}
