// SPDX-License-Identifier: MIT
// What happened: writes and connections of this server, faults, edits and commands of the machine.
import {on, request, state} from './link.js';
import {h} from './dom.js';
import {remember} from './place.js';
import {timeText} from './timeline_moves.js';

const kinds = ['fault', 'write', 'edit', 'rejected', 'command', 'failed', 'message', 'client',
               'panel', 'machine'];
const kindOfMark = {
    start: 'command',
    stop: 'command'
};
const maxLines = 500;

/**
 * @typedef {object} Line
 * @property {string} kind
 * @property {number} unix_ms
 * @property {string} text
 */

/// A row of `show fault` as a line of the log.
const faultLine = row => ({
    kind: 'fault',
    unix_ms: Date.now() - row.age_ns / 1e6,
    text: row.sentence + (row.count > 1 ? ` (${row.count} times)` : '')
});

const element = ({kind, unix_ms, text}) =>
    h('li', {class: kind === 'fault' ? 'bad' : ''},
      h('time', {}, new Date(unix_ms).toLocaleTimeString([], {hour12: false})),
      h('span', {class: 'dim kind'}, `${kind} `), h('span', {}, text));

/** The view of the log. */
export class View {
    /**
     * @param {HTMLElement} main
     * @param {URLSearchParams} query
     */
    constructor(main, query) {
        this.hidden = new Set((query.get('hide') ?? '').split(',').filter(kind => kind));
        /** @type {Line[]} */
        this.faults = [];
        this.list = h('ul', {class: 'plain log', id: 'log'});
        this.filter = h('input', {
            type: 'search',
            class: 'grow',
            placeholder: 'Filter',
            'aria-label': 'Filter',
            value: query.get('filter') ?? '',
            oninput: () => {
                remember({filter: this.filter.value});
                this.draw();
            }
        });
        const buttons = kinds.map(kind => this.button(kind));
        main.append(
            h('div', {class: 'bar'}, this.filter,
              h('span', {class: 'bar tight', role: 'group', 'aria-label': 'Kinds to show'},
                buttons)),
            h('div', {class: 'card'}, this.list));
        this.draw();
        this.readFaults();
        this.timer = setInterval(() => this.readFaults(), 2000);
        this.unsubscribe = on('logged', () => this.draw());
    }

    end() {
        clearInterval(this.timer);
        this.unsubscribe();
    }

    /// Makes the button that shows and hides a kind.
    button(kind) {
        return h('button', {
            'aria-pressed': String(!this.hidden.has(kind)),
            onclick: event => {
                if (!this.hidden.delete(kind)) this.hidden.add(kind);
                event.currentTarget.setAttribute('aria-pressed', String(!this.hidden.has(kind)));
                remember({hide: [...this.hidden].join(',')});
                this.draw();
            }
        },
                 kind);
    }

    /// What happened in a journal up to the moment.
    happened() {
        const {timeline, moment} = state.past;
        return (timeline?.marks ?? [])
            .filter(mark => mark.cycles <= (moment?.cycles ?? 0))
            .map(({kind, text, time_ns}) => ({
                     kind: kind in kindOfMark ? kindOfMark[kind] : kind,
                     text: `${text} (${timeText(time_ns)})`,
                     unix_ms: (timeline.unix_ns + time_ns) / 1e6
                 }));
    }

    /// The lines to show, newest first. The machine's own faults replace those of the server.
    lines() {
        const word = this.filter.value.toLowerCase();
        const own = state.log.filter(one => one.kind !== 'fault' || this.faults.length === 0);
        const all = state.past ? this.happened() : [...own, ...this.faults];
        return all
            .filter(one => !this.hidden.has(one.kind) && one.text.toLowerCase().includes(word))
            .sort((a, b) => b.unix_ms - a.unix_ms)
            .slice(0, maxLines);
    }

    draw() {
        const lines = this.lines();
        this.list.replaceChildren(...lines.map(element));
        if (lines.length === 0)
            this.list.append(
                h('li', {class: 'dim'},
                  state.past ? 'Nothing happened before this moment.' :
                               'Nothing happened since this page was opened.'));
    }

    async readFaults() {
        const reply = await request({run: ['show', 'fault']});
        if (!reply.ok) return;
        try {
            this.faults = JSON.parse(reply.out).map(faultLine);
        } catch {
            this.faults = [];
        }
        this.draw();
    }
}
