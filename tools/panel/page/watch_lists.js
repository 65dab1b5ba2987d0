// SPDX-License-Identifier: MIT
// Watch lists under a name, kept in the storage of the browser.
import {compareNames} from './names.js';

const key = 'halcyon.watch-lists';

/**
 * Returns the lists by name. Damaged or missing content is no list.
 * @param {Storage} storage
 * @returns {Map<string, string[]>} in the order of names
 */
export function lists(storage) {
    try {
        const all = Object.entries(JSON.parse(storage.getItem(key) ?? '{}'));
        const valid = all.filter(
            ([, names]) => Array.isArray(names) && names.every(name => typeof name === 'string'));
        return new Map(valid.sort(([a], [b]) => compareNames(a, b)));
    } catch {
        return new Map();
    }
}

/**
 * Keeps a list; without names it is removed.
 * @param {Storage} storage
 * @param {string} title
 * @param {string[]} names
 * @returns {boolean} false when the browser does not store it
 */
export function keep(storage, title, names) {
    const all = lists(storage);
    if (names.length > 0)
        all.set(title, names);
    else
        all.delete(title);
    try {
        storage.setItem(key, JSON.stringify(Object.fromEntries(all)));
        return true;
    } catch {
        return false;
    }
}
