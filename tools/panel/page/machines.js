// SPDX-License-Identifier: MIT
// The menu of the machines that the page can show, and the address that shows one of them.

/**
 * @typedef {object} Machine as hal panel reports it
 * @property {string} name
 * @property {string[]} files what its command line loads
 * @property {number} pid 0: unknown
 * @property {string} state absent, ended, running, stopped, silent
 */

const states = {
    absent: 'not running',
    ended: 'ended',
    running: 'running',
    stopped: 'stopped',
    silent: 'not responding'
};

const fileName = path => path.split('/').pop();

/**
 * The text of a machine: its name, netlist, process and state.
 * @param {Machine} machine
 */
export function textOf({name, files, pid, state}) {
    const parts = [files.map(fileName).join(' '), pid > 0 ? `process ${pid}` : '', states[state]];
    return `${name}: ${parts.filter(part => part).join(', ')}`;
}

/**
 * The rows of the menu. None when there is nothing to choose.
 * @param {Machine[]} machines
 * @param {string} shown the name of the machine that the page shows
 * @returns {{name: string, text: string, isShown: boolean}[]}
 */
export function menuOf(machines, shown) {
    const isKnown = machines.some(({name}) => name === shown);
    const missing = {name: shown, files: [], pid: 0, state: 'absent'};
    const all = isKnown || shown === '' ? machines : [...machines, missing];
    if (all.length < 2) return [];
    return all.map(
        machine =>
            ({name: machine.name, text: textOf(machine), isShown: machine.name === shown}));
}

/**
 * The machine that an address names; '' that of the command line of hal panel.
 * @param {string} search of the address: ?machine=mill
 */
export const chosenIn = search => new URLSearchParams(search).get('machine') ?? '';

/**
 * The address of the same view of another machine.
 * @param {{pathname: string, hash: string}} place
 * @param {string} name
 * @param {string} own the machine of the command line of hal panel
 */
export function addressOf({pathname, hash}, name, own) {
    const query = name === own ? '' : `?machine=${encodeURIComponent(name)}`;
    return pathname + query + hash;
}
