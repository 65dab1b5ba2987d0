// SPDX-License-Identifier: MIT
// Views, their place in the URL (#/view?state), the banner and the role.
import {connect, on, state, tell} from './link.js';
import {h, announce} from './dom.js';

const views = {
    overview: ['Overview', () => import('./overview.js')],
    panel: ['Panel', () => import('./panel.js')],
    graph: ['Graph', () => import('./graph.js')],
    scope: ['Scope', () => import('./scope.js')],
    watch: ['Watch', () => import('./watch.js')],
    networks: ['Networks', () => import('./networks.js')],
    log: ['Log', () => import('./log.js')],
};

let leave = null, shown = '';
const main = document.getElementById('main'), nav = document.getElementById('views');

/// The view of the URL and its parameters.
function place() {
    const [, name = 'overview', query = ''] = /^#\/(\w+)(?:\?(.*))?$/.exec(location.hash) ?? [];
    return {name: views[name] ? name : 'overview', query: new URLSearchParams(query)};
}

/// Keeps the state of the present view in the URL.
export function remember(values) {
    const {name, query} = place();
    for (const [key, value] of Object.entries(values)) {
        if (value === '' || value === null || value === undefined)
            query.delete(key);
        else
            query.set(key, value);
    }
    const text = query.toString();
    shown = `#/${name}${text ? '?' + text : ''}`;
    history.replaceState(null, '', shown);
}

async function show() {
    if (/[#&]t=/.test(location.hash) || location.hash === '#main' || location.hash === shown)
        return;
    shown = location.hash;
    const {name, query} = place();
    if (leave) leave();
    leave = null;
    drawNav();
    main.replaceChildren(h('p', {class: 'dim'}, 'Loading …'));
    const module = await views[name][1]();
    if (place().name !== name) return;
    main.replaceChildren();
    document.title = `${views[name][0]} · ${state.instance || 'Halcyon'}`;
    leave = module.show(main, query) ?? null;
}

function drawNav() {
    const current = place().name;
    nav.replaceChildren(
        ...Object.entries(views)
            .filter(([name]) => name !== 'panel' || state.panel)
            .map(
                ([name, [title]]) =>
                    h('a', {href: `#/${name}`, 'aria-current': name === current ? 'page' : null},
                      title)));
}

let lastBanner = '';
function drawState() {
    document.getElementById('machine').textContent = state.instance || 'Halcyon';
    const problem = state.server === 'connecting' ?
        '' :
        state.server === 'lost' ?
        `No connection to hal panel${
            state.reason ? `: ${state.reason}` : ''}. Values are stale; reconnecting …` :
        !state.machine ?
        `Machine '${
            state
                .instance}' is not running. Values are stale; waiting for it. Start it with: hal run FILE.hal` :
        !state.responding ? `Machine '${state.instance}' does not respond. Values are stale.` :
                            '';
    const banner = document.getElementById('banner');
    banner.hidden = problem === '';
    banner.textContent = problem;
    document.body.classList.toggle('stale', problem !== '');
    if (problem === '' && lastBanner !== '') announce(`Machine '${state.instance}' is running`);
    lastBanner = problem;
    const button = document.getElementById('control');
    button.hidden = !(state.write && state.token);
    button.textContent = state.held ? 'Release control' : 'Take control';
    document.getElementById('role').textContent = !state.write ? 'read-only' :
        state.held                                             ? 'in control' :
        !state.token                                           ? 'read-only: no token' :
        state.holder ? `page ${state.holder} has control` :
                       'read-only';
}

document.getElementById('control').addEventListener(
    'click', () => tell(state.held ? {release: true} : {take: true}));
on('state', drawState);
on('welcome', () => {
    drawNav();
    if (state.panel && (location.hash === '' || location.hash === '#/overview') &&
        !sessionStorage.getItem('seen'))
        location.hash = '#/panel';
    sessionStorage.setItem('seen', '1');
});
addEventListener('hashchange', show);
// Alt with a digit switches the view.
addEventListener('keydown', event => {
    const index = '123456789'.indexOf(event.key);
    if (!event.altKey || index < 0 || event.key === '') return;
    const links = nav.querySelectorAll('a');
    if (links[index]) {
        location.hash = links[index].hash;
        event.preventDefault();
    }
});
connect();
show();
window.halcyon = state;  // for tests
