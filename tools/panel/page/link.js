// SPDX-License-Identifier: MIT
// The connection to the server: requests with replies, subscriptions that survive a restart of the
// machine, the state of both.
import {chosenIn} from './machines.js';

const listeners = new Map();  // event -> Set of functions
export function on(event, act) {
    if (!listeners.has(event)) listeners.set(event, new Set());
    listeners.get(event).add(act);
    return () => listeners.get(event).delete(act);
}
function emit(event, data, payload) {
    for (const act of [...(listeners.get(event) ?? [])])
        act(data, payload);
}

export const state = {
    server: 'connecting',
    machine: null,   // whether it is up; null until the server has answered
    responding: true,
    running: true,  // false after `stop`: functions do not run
    running_ns: 0,  // machine time of the last change of `running`, 0: unknown
    faults: 0,      // not acknowledged
    instance: '',
    own: '',       // the instance of the command line of hal panel
    machines: [],  // those that the page can show, machines.js
    hal: 'hal',  // how the user started hal panel: './hal' in a clone
    version: '',
    pid: 0,
    write: false,
    token: false,
    held: false,
    holder: null,
    panel: null,
    past: null,      // {timeline, moment} of a replayed machine, docs/protocol.md; null: it is live
    recordings: [],  // {name, notes, columns, seconds}: what hal panel can show besides the machine
    reason: '',
    log: [],
    stats: {messages: 0, bytes: 0}
};

/// Whether values are those of a machine whose functions run.
export const isLive = () =>
    state.server === 'up' && state.machine && state.responding && state.running;

let socket = null, nextId = 1, replies = new Map(), samples = null, lastReply = 0;
const subscriptions = new Set(), probes = new Set();
const awaited = new Map();  // rows of recordings, by the number in their event

function takeToken() {
    const found = /[#&]t=([0-9a-f]+)/.exec(location.hash);
    if (found) {
        sessionStorage.setItem('token', found[1]);
        const rest = location.hash.replace(found[0], '');  // no token stays in the address bar
        history.replaceState(
            null, '',
            location.pathname + location.search + (rest.startsWith('#/') ? rest : '#/overview'));
    }
    return sessionStorage.getItem('token');
}

/// Sends a request of the control protocol. Resolves with the reply.
export function request(body) {
    const isOpen = socket && socket.readyState === WebSocket.OPEN;
    if (!isOpen && 'recording' in body)
        return Promise.resolve({ok: false, error: 'no connection to hal panel'});
    if (!isOpen || !(state.machine || 'recording' in body))
        return Promise.resolve({ok: false, error: 'the machine is not running'});
    const id = nextId++;
    return new Promise(resolve => {
        replies.set(id, {resolve, byServer: 'recording' in body});
        socket.send(JSON.stringify({id, ...body}));
    });
}
export function tell(body) {
    if (socket && socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(body));
}

/// Subscribes to values: act(values, event) for each event. Returns a function that ends it.
export function subscribe(names, every_ms, act, changes = false) {
    const one = {names, every_ms, act, changes, number: null};
    subscriptions.add(one);
    start(one);
    return () => {
        subscriptions.delete(one);
        if (one.number !== null) request({unsubscribe: one.number});
        one.number = null;
    };
}
async function start(one) {
    if (!state.machine || one.names.length === 0) return;
    const reply =
        await request({subscribe: one.names, every_ms: one.every_ms, changes: one.changes});
    if (reply.ok) {
        if (subscriptions.has(one))
            one.number = reply.subscription;
        else
            request({unsubscribe: reply.subscription});
    }
}

/// Probes names: act(event, ArrayBuffer of the rows, layout). Calls failed(reply) when the machine
/// has no probes. Returns a function that ends it.
export function probe(names, options, act, failed) {
    const one = {names, options, act, failed, number: null, layout: null};
    probes.add(one);
    startProbe(one);
    return () => {
        probes.delete(one);
        if (one.number !== null) request({unprobe: one.number});
        one.number = null;
    };
}
/// Reads names of a recording: act(event, ArrayBuffer of the rows) is called once, after the reply
/// is returned, which is the layout.
export async function readRecording(index, names, act) {
    const reply = await request({recording: index, names});
    if (reply.ok) awaited.set(reply.probe, act);
    return reply;
}
/// Reads names around the moment of a replayed machine, in the same way.
export async function readAround(names, before_ms, after_ms, act) {
    const reply = await request({around: names, before_ms, after_ms});
    if (reply.ok) awaited.set(reply.probe, act);
    return reply;
}
async function startProbe(one) {
    if (!state.machine || one.names.length === 0) return;
    const reply = await request({probe: one.names, ...one.options});
    if (!reply.ok) {
        if (probes.delete(one)) one.failed(reply);
        return;
    }
    if (!probes.has(one)) return request({unprobe: reply.probe});
    one.number = reply.probe;
    one.layout = reply;
}

/// Ends what waits for the machine; `all`: for the server, too.
function settle(all) {
    for (const [id, {resolve, byServer}] of replies) {
        if (byServer && !all) continue;
        replies.delete(id);
        resolve({ok: false, error: 'the connection is lost'});
    }
    if (all) awaited.clear();
    for (const one of subscriptions)
        one.number = null;
    for (const one of probes)
        one.number = null;
}

function machine(event) {
    settle(false);
    state.machine = event.up;
    if (event.up)
        Object.assign(state, {
            version: event.hello.version,
            pid: event.hello.pid,
            responding: true,
            running: true,
            running_ns: 0,
            faults: 0
        });
    state.past = event.up && event.hello.replay ? {timeline: null, moment: null} : null;
    lastReply = performance.now();
    emit('state');
    if (!event.hello?.replay)
        note({
            kind: 'machine',
            unix_ms: Date.now(),
            text: event.up ? `machine '${state.instance}' is running, process ${state.pid}` :
                             `machine '${state.instance}' is lost`
        });
    if (!event.up) return;
    for (const one of subscriptions)
        start(one);
    for (const one of probes)
        startProbe(one);
    emit('machine');
    readStatus(0);
    if (state.past) followMoment();
}

/// Reads the time line of a replayed machine; its events follow.
async function followMoment() {
    const reply = await request({moment: true});
    if (!reply.ok || !state.past) return;
    state.past = {timeline: reply.timeline, moment: reply.moment};
    emit('marks');
    moveTo(reply.moment);
}

let knownEdits = -1;
function moveTo(moment) {
    state.past.moment = moment;
    emit('moment');
    if (moment.moving) return;
    emit('logged');
    // behind another number of edits the machine may have other names
    if (moment.edits !== knownEdits) emit('machine');
    knownEdits = moment.edits;
    readStatus(0);
}

const marksInterval = 200;  // ms
let marksTimer = 0;
/// The first execution of a journal may find thousands of marks: pages draw them together.
function noteMark(mark) {
    state.past.timeline.marks.push(mark);
    if (marksTimer !== 0) return;
    marksTimer = setTimeout(() => {
        marksTimer = 0;
        if (state.past?.timeline) emit('marks');
    }, marksInterval);
}

function note(entry) {
    if (state.log.some(one => one.unix_ms === entry.unix_ms && one.text === entry.text))
        return;  // sent again after a reconnection
    state.log.push(entry);
    if (state.log.length > 1000) state.log.shift();
    emit('logged');
}

function receive(text) {
    const message = JSON.parse(text);
    lastReply = performance.now();
    if (!message.event) {
        const waiting = replies.get(message.id);
        replies.delete(message.id);
        waiting?.resolve(message);
        return;
    }
    switch (message.event) {
        case 'welcome':
            Object.assign(state, {
                server: 'up',
                instance: message.instance,
                own: message.own,
                hal: message.hal,
                write: message.write,
                token: message.token,
                panel: message.panel ?? null,
                recordings: message.recordings ?? []
            });
            emit('welcome');
            emit('state');
            break;
        case 'machine':
            machine(message);
            break;
        case 'machines':
            state.machines = message.machines;
            emit('machines');
            break;
        case 'control':
            Object.assign(state, {held: message.held, holder: message.holder});
            emit('state');
            break;
        case 'values':
            for (const one of subscriptions)
                if (one.number === message.subscription) one.act(message.values, message);
            break;
        case 'samples':
            samples = message;
            break;
        case 'layout':
            for (const one of probes)
                if (one.number === message.probe) Object.assign(one.layout, message);
            break;
        case 'moment':
            if (state.past?.timeline) moveTo(message);
            break;
        case 'mark':
            if (state.past?.timeline) noteMark(message);
            break;
        case 'log':
            note(message);
            break;
        case 'journal':
            note({
                kind: message.kind,
                text: message.text,
                unix_ms: Date.now(),
                time_ns: message.time_ns
            });
            readStatus(message.time_ns);
            break;
        default:
            emit(message.event, message);
    }
}

function receiveBytes(bytes) {
    const event = samples;
    samples = null;
    if (!event) return;
    for (const one of probes)
        if (one.number === event.probe) one.act(event, bytes, one.layout);
    awaited.get(event.probe)?.(event, bytes);
    awaited.delete(event.probe);
}

export function connect() {
    const token = takeToken() ?? undefined, machine = chosenIn(location.search) || undefined;
    socket = new WebSocket(`ws://${location.host}/`, 'halcyon.panel.v1');
    socket.binaryType = 'arraybuffer';
    socket.onopen = () => tell({hello: {token, machine}});
    socket.onmessage = message => {
        state.stats.messages++;
        state.stats.bytes += message.data.length ?? message.data.byteLength;
        if (typeof message.data === 'string')
            receive(message.data);
        else
            receiveBytes(message.data);
    };
    socket.onclose = event => {
        settle(true);
        state.server = 'lost';
        state.machine = state.held = false;
        state.reason = event.reason;
        if (event.reason === 'wrong token') sessionStorage.removeItem('token');
        emit('state');
        setTimeout(connect, 1000);
    };
}
window.addEventListener('hashchange', () => {
    if (/[#&]t=/.test(location.hash)) {
        takeToken();
        socket?.close();
    }
});

let statusIsRead = false, statusAgain = null;  // time_ns of an entry that came meanwhile

/// Reads whether the functions run, and how many faults are not acknowledged; one request at a
/// time. `time_ns`: the machine's time of the journal's entry after which it is read, or 0.
async function readStatus(time_ns) {
    if (statusIsRead) {
        statusAgain = time_ns || statusAgain;
        return;
    }
    statusIsRead = true;
    const reply = await request({run: ['status']});
    statusIsRead = false;
    const entry_ns = statusAgain || time_ns, again = statusAgain;
    statusAgain = null;
    if (reply.ok) noteStatus(JSON.parse(reply.out), entry_ns);
    if (again) readStatus(again);
}

function noteStatus({running: runs, faults}, time_ns) {
    const running = state.past ? state.past.moment?.running ?? true : runs;
    if (running === state.running && faults === state.faults) return;
    if (running !== state.running) state.running_ns = time_ns;
    Object.assign(state, {running, faults});
    emit('state');
}

// A suspended machine (SIGSTOP, a debugger) keeps its connection and answers nothing.
setInterval(() => {
    if (!state.machine) return;
    const responding = performance.now() - lastReply < 3000;
    if (responding !== state.responding) {
        state.responding = responding;
        emit('state');
    }
    readStatus(0);
}, 1000);
