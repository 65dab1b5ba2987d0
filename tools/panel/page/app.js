// SPDX-License-Identifier: MIT
// Views, their place in the URL (#/view?state), the banner and the role. Each view is a module with
// a class View: its constructor draws it, end() leaves it.
import {pauseOf, problemOf} from './banner.js';
import {connect, on, state, tell} from './link.js';
import {h, announce} from './dom.js';
import {addressOf, menuOf} from './machines.js';
import {enter, isShown, parse} from './place.js';
import {TimeLine} from './timeline.js';

const views = {
    overview: ['Overview', () => import('./overview.js')],
    panel: ['Panel', () => import('./panel.js')],
    graph: ['Graph', () => import('./graph.js')],
    scope: ['Scope', () => import('./scope.js')],
    watch: ['Watch', () => import('./watch.js')],
    networks: ['Networks', () => import('./networks.js')],
    log: ['Log', () => import('./log.js')],
};

let view = null;
let shown = 0;  // counts calls of show(): loading a module may take longer than the next call
const main = document.getElementById('main'), nav = document.getElementById('views');

const place = () => parse(location.hash, Object.keys(views));

async function show() {
    if (/[#&]t=/.test(location.hash) || location.hash === '#main' || isShown(location.hash)) return;
    enter(location.hash);
    const call = ++shown;
    const {name, query} = place();
    view?.end();
    view = null;
    drawNav();
    main.replaceChildren(h('p', {class: 'dim'}, 'Loading …'));
    const module = await views[name][1]();
    if (call !== shown) return;
    main.replaceChildren();
    document.title = `${views[name][0]} · ${state.instance || 'Halcyon'}`;
    view = new module.View(main, query);
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
    nav.querySelector('[aria-current]')?.scrollIntoView({inline: 'nearest', block: 'nearest'});
}

function drawFaults({machine, faults}) {
    const mark = document.getElementById('faults'),
          words = `${faults} ${faults === 1 ? 'fault' : 'faults'}`;
    mark.hidden = !machine || faults === 0;
    if (mark.textContent === words) return;
    mark.textContent = words;
    if (!mark.hidden) announce(`${words}, not acknowledged`);
}

/// What this page may do.
function roleOf({write, held, token, holder, past}) {
    if (past) return 'the past: read-only';
    if (!write) return 'read-only';
    if (held) return 'in control';
    if (!token) return 'read-only: no token';
    return holder ? `page ${holder} has control` : 'read-only';
}

const menu = /** @type {HTMLSelectElement} */ (document.getElementById('machines'));
let shownMenu = '';

/// The menu of the machines, in the place of the name.
function drawMenu() {
    const rows = menuOf(state.machines, state.instance);
    const texts = JSON.stringify(rows);
    if (texts === shownMenu) return;  // a menu that is open would be closed
    shownMenu = texts;
    menu.hidden = rows.length === 0;
    document.getElementById('machine').classList.toggle('unseen', rows.length > 0);
    const optionOf = ({name, text, isShown}) =>
        h('option', {value: name, selected: isShown}, text);
    menu.replaceChildren(...rows.map(optionOf));
}

/// Shows another machine in the same view: the page begins again, with nothing of this one.
menu.addEventListener(
    'change', () => location.assign(addressOf(location, menu.value, state.own)));

let lastBanner = '';
function drawState() {
    document.getElementById('machine').textContent =
        state.past?.timeline?.file || state.instance || 'Halcyon';
    document.body.classList.toggle('past', state.past !== null);
    drawMenu();
    const problem = problemOf(state), pause = problem === '' ? pauseOf(state) : '';
    const banner = document.getElementById('banner');
    banner.hidden = problem === '' && pause === '';
    banner.textContent = problem || pause;
    banner.classList.toggle('stopped', pause !== '');
    drawFaults(state);
    document.body.classList.toggle('stale', problem !== '');
    document.body.classList.toggle('paused', pause !== '');
    if (problem === '' && lastBanner !== '') announce(`Machine '${state.instance}' is running`);
    lastBanner = problem;
    const button = document.getElementById('control');
    button.hidden = !(state.write && state.token) || state.past !== null;
    button.textContent = state.held ? 'Release control' : 'Take control';
    document.getElementById('role').textContent = roleOf(state);
}

document.getElementById('control').addEventListener(
    'click', () => tell(state.held ? {release: true} : {take: true}));
new TimeLine(document.getElementById('past'));
on('state', drawState);
on('marks', drawState);
on('machines', drawMenu);
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
Object.assign(window, {halcyon: state});  // for tests
