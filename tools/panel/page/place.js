// SPDX-License-Identifier: MIT
// The place of the page in its URL: #/view?state. A view keeps its state there, so that a link
// shows the same again.

/**
 * @typedef {object} Place
 * @property {string} name the view
 * @property {URLSearchParams} query its state
 */

let shown = '';  // the hash of what the page shows

/**
 * Reads the hash of a URL.
 * @param {string} hash
 * @param {string[]} names the views; the first one is shown for any other name
 * @returns {Place}
 */
export function parse(hash, names) {
    const [, name = names[0], query = ''] = /^#\/(\w+)(?:\?(.*))?$/.exec(hash) ?? [];
    return {name: names.includes(name) ? name : names[0], query: new URLSearchParams(query)};
}

/**
 * The hash of the same view with changed state. An empty value removes its key.
 * @param {string} hash
 * @param {Record<string, string | number | null | undefined>} values
 * @returns {string}
 */
export function changed(hash, values) {
    const [, view = '', query = ''] = /^#\/(\w+)(?:\?(.*))?$/.exec(hash) ?? [];
    const parameters = new URLSearchParams(query);
    for (const [key, value] of Object.entries(values)) {
        if (value === '' || value === null || value === undefined)
            parameters.delete(key);
        else
            parameters.set(key, String(value));
    }
    const text = parameters.toString();
    return `#/${view}${text ? '?' + text : ''}`;
}

/**
 * Keeps the state of the present view in the URL.
 * @param {Record<string, string | number | null | undefined>} values
 */
export function remember(values) {
    shown = changed(location.hash || '#/overview', values);
    history.replaceState(null, '', shown);
}

/**
 * States what the page shows from now on.
 * @param {string} hash
 */
export function enter(hash) { shown = hash; }

/**
 * Whether the page shows this hash already: it was entered, or a view wrote it.
 * @param {string} hash
 */
export const isShown = hash => hash === shown;
