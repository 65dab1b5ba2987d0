// SPDX-License-Identifier: MIT
// The time line of a replayed machine: its moment is moved by dragging, keys and buttons. One
// request is under way at a time; of those that wait, only the newest is sent.
import {on, request, state} from './link.js';
import {announce, h, text} from './dom.js';
import {Moves, noteText, percent, timeText} from './timeline_moves.js';

const pageStep = 1e9;  // ns, of Page Up and Page Down
const kinds = {
    fault: 'Fault',
    edit: 'Edit',
    start: 'Start',
    stop: 'Stop'
};

/** The bar below the header, while a replayed machine is shown. */
export class TimeLine {
    /** @param {HTMLElement} bar */
    constructor(bar) {
        this.bar = bar;
        this.moves = new Moves();
        this.isMoving = false;
        this.drag_ns = null;  // where the pointer holds it
        this.known_ns = 0;    // executed up to here, so that all marks are known
        this.makeTrack();
        this.makeButtons();
        this.note = h('p', {id: 'moment-note', class: 'dim', role: 'status'});
        bar.append(this.buttons, this.track, this.note);
        on('moment', () => this.draw());
        on('marks', () => this.drawMarks());
        on('state', () => {
            this.bar.hidden = !state.past;
        });
    }

    makeTrack() {
        this.unknown = h('div', {class: 'unknown'});
        this.thumb = h('div', {class: 'thumb'});
        this.marks = h('div', {class: 'marks', 'aria-hidden': 'true'});
        this.track =
            h('div', {
                id: 'timeline',
                role: 'slider',
                tabindex: 0,
                'aria-label':
                    'Moment of the journal. Left and right move by a cycle, page up and ' +
                    'page down by a second, home and end to its begin and end.',
                'aria-valuemin': '0',
                onpointerdown: event => this.beginDrag(event),
                onpointermove: event => this.dragTo(event),
                onpointerup: () => this.endDrag(),
                onpointercancel: () => this.endDrag(),
                onkeydown: event => this.key(event)
            },
              this.unknown, this.marks, this.thumb);
    }

    makeButtons() {
        const button = (id, title, label, act) =>
            h('button', {id, title, 'aria-label': title, onclick: act}, label);
        this.threads = h('select', {'aria-label': 'Thread of a step'});
        this.happened = h('select', {
            id: 'happened',
            'aria-label': 'What happened',
            onchange: () => {
                const mark = state.past.timeline.marks[Number(this.happened.value)];
                if (mark) this.goTo(mark.time_ns);
                this.happened.value = '';
            }
        });
        this.condition = h('input', {
            id: 'condition',
            size: 18,
            placeholder: 'Condition: x-error > 0.5',
            'aria-label': 'Condition of continue and reverse, such as x-error > 0.5',
            onchange: () => this.move(['break', ...this.conditionWords()])
        });
        this.pause = button('pause', 'Stop the move', '■', () => request({run: ['pause']}));
        this.where = h('b', {id: 'moment', class: 'mono'});
        this.buttons =
            h('div', {class: 'moves'},
              button('fault-back', 'Previous fault', '⚑ ◀', () => this.move(['fault', 'previous'])),
              button(
                  'reverse', 'Reverse: back to where the condition begins to hold', '◀◀',
                  () => this.move(['reverse'])),
              button('step-back', 'Step back', '◀', () => this.step(-1)),
              button('step', 'Step', '▶', () => this.step(1)), this.threads,
              button(
                  'continue', 'Continue: to where the condition begins to hold, or to the end',
                  '▶▶', () => this.move(['continue'])),
              button('fault-next', 'Next fault', '▶ ⚑', () => this.move(['fault', 'next'])),
              this.pause, this.condition, this.happened, this.where);
    }

    conditionWords() { return this.condition.value.trim().split(/\s+/).filter(word => word); }

    // ---- moves

    goTo(time_ns) {
        if (!state.past?.timeline) return;  // the connection was lost meanwhile
        const {end_ns} = state.past.timeline;
        this.move(['goto', `${Math.round(Math.min(end_ns, Math.max(0, time_ns)))}ns`]);
    }

    step(count) {
        this.moves.addSteps(count, this.threads.value);
        this.send();
    }

    move(words) {
        this.moves.add(words);
        this.send();
    }

    async send() {
        if (this.isMoving) return;
        this.isMoving = true;
        for (let words; (words = this.moves.next());) {
            const reply = await request({run: words});
            this.report(reply.ok ? reply.err : reply.error);
        }
        this.isMoving = false;
    }

    /// Shows why a move was not made.
    report(problem) {
        const isReplaced = /^replaced by a newer goto/.test(problem);
        this.problem = isReplaced ? '' : problem.trim();
        if (this.problem) announce(this.problem);
        this.drawNote();
    }

    // ---- pointer and keys

    timeAt(event) {
        const {left, width} = this.track.getBoundingClientRect();
        return state.past.timeline.end_ns *
            Math.min(1, Math.max(0, (event.clientX - left) / width));
    }

    beginDrag(event) {
        if (!state.past?.timeline) return;
        this.track.setPointerCapture(event.pointerId);
        this.drag_ns = this.timeAt(event);
        this.dragTo(event);
    }

    dragTo(event) {
        if (this.drag_ns === null || !state.past?.timeline) return;
        this.drag_ns = this.timeAt(event);
        this.goTo(this.drag_ns);
        this.drawThumb(this.drag_ns);
    }

    endDrag() { this.drag_ns = null; }

    key(event) {
        const moment = state.past?.moment;
        if (!moment || event.altKey || event.ctrlKey || event.metaKey) return;
        const now_ns = moment.time_ns ?? 0;
        const act = {
            ArrowLeft: () => this.step(-1),
            ArrowRight: () => this.step(1),
            PageUp: () => this.goTo(now_ns - pageStep),
            PageDown: () => this.goTo(now_ns + pageStep),
            Home: () => this.goTo(0),
            End: () => this.goTo(state.past.timeline.end_ns)
        }[event.key];
        if (!act) return;
        event.preventDefault();
        act();
    }

    // ---- what is shown

    draw() {
        const {past} = state;
        this.bar.hidden = !past;
        if (!past?.timeline) return;
        const {moment, timeline} = past;
        if (this.timeline !== timeline) this.known_ns = 0;  // of another journal
        this.timeline = timeline;
        this.known_ns =
            moment.ended ? timeline.end_ns : Math.max(this.known_ns, moment.time_ns ?? 0);
        this.unknown.style.left = `${percent(this.known_ns, timeline.end_ns)}%`;
        if (this.drag_ns === null) this.drawThumb(moment.time_ns ?? 0);
        text(this.where, moment.cycles > 0 ? moment.text : 'before the first cycle');
        this.track.setAttribute('aria-valuemax', String(timeline.end_ns / 1e9));
        this.track.setAttribute('aria-valuenow', String((moment.time_ns ?? 0) / 1e9));
        this.track.setAttribute('aria-valuetext', this.where.textContent);
        this.pause.disabled = !moment.moving;
        if (document.activeElement !== this.condition && moment.condition !== undefined)
            this.condition.value = moment.condition;
        this.drawNote();
    }

    drawThumb(time_ns) {
        this.thumb.style.left = `${percent(time_ns, state.past.timeline.end_ns)}%`;
    }

    drawMarks() {
        const {timeline} = state.past;
        if (this.threads.options.length !== timeline.threads.length + 1)
            this.threads.replaceChildren(
                h('option', {value: ''}, 'all threads'),
                ...timeline.threads.map(({name}) => h('option', {value: name}, name)));
        this.marks.replaceChildren(...timeline.marks.map(mark => {
            const element = h('div', {
                class: `mark ${mark.kind}`,
                title: `${kinds[mark.kind]} at ${timeText(mark.time_ns)}: ${mark.text}`
            });
            element.style.left = `${percent(mark.time_ns, timeline.end_ns)}%`;
            return element;
        }));
        const count = timeline.marks.length;
        this.happened.hidden = count === 0;
        this.happened.replaceChildren(
            h('option', {value: ''}, `${count} ${count === 1 ? 'mark' : 'marks'}`),
            ...timeline.marks.map(
                (mark, i) =>
                    h('option', {value: String(i)},
                      `${timeText(mark.time_ns)} ${kinds[mark.kind]}: ${mark.text.slice(0, 80)}`)));
        this.draw();
    }

    drawNote() {
        const {past} = state;
        text(this.note, noteText(this.problem, past?.moment, past?.timeline?.notes));
        this.note.classList.toggle('bad', Boolean(this.problem));
    }
}
