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
 * Splits a hash.
 * @param {string} hash
 * @returns {{view: string, query: string}} both empty for a hash without a view
 */
function split(hash) {
    const [path, query] = hash.split(/\?(.*)/s);
    const view = path.startsWith('#/') ? path.slice(2) : '';
    if (!/^\w+$/.test(view)) return {view: '', query: ''};
    return {view, query: query ?? ''};
}

/**
 * Reads the hash of a URL.
 * @param {string} hash
 * @param {string[]} names the views; the first one is shown for any other name
 * @returns {Place}
 */
export function parse(hash, names) {
    const {view, query} = split(hash);
    const name = names.includes(view) ? view : names[0];
    return {name, query: new URLSearchParams(query)};
}

/**
 * The hash of the same view with changed state. An empty value removes its key.
 * @param {string} hash
 * @param {Record<string, string | number | null | undefined>} values
 * @returns {string}
 */
export function changed(hash, values) {
    const {view, query} = split(hash);
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
