// SPDX-License-Identifier: MIT
// client.mjs URL SUBPROTOCOL: connects as Foxglove does, and prints "ok" or "FAIL" for what the server of `hal panel --write` does.
import module from '@foxglove/ws-protocol';
import WebSocket from 'ws';

const FoxgloveClient = module.FoxgloveClient ?? module.default.FoxgloveClient, [url, name] = process.argv.slice(2);
let failed = 0;
const check = (what, good, seen) => {
  if (!good) failed++;
  console.log(`${good ? 'ok  ' : 'FAIL'} ${what}${good ? '' : ` ${JSON.stringify(seen)}`}`);
};
const late = setTimeout(() => { console.log('FAIL time is up'); process.exit(1); }, 60000);

const socket = new WebSocket(url, [name]), client = new FoxgloveClient({ws: socket});
const channels = new Map(), seen = {times: [], messages: new Map(), parameters: new Map(), statuses: [], order: []};
const once = (event, good = () => true) => new Promise(resolve => client.on(event, function act(...given) {
  if (!good(...given)) return;
  client.off(event, act);
  resolve(given[0]);
}));
client.on('error', error => check('no error', false, String(error)));
client.on('serverInfo', () => seen.order.push('serverInfo'));
client.on('advertise', added => { seen.order.push('advertise'); for (const channel of added) channels.set(channel.topic, channel); });
client.on('time', ({timestamp}) => seen.times.push(timestamp));
client.on('status', status => seen.statuses.push(status));

const advertised = once('advertise', added => added.some(channel => channel.topic === '/sine'));
const info = await once('serverInfo');
check('the subprotocol is echoed', socket.protocol === name, socket.protocol);
check('the server names its capabilities', ['time', 'parameters', 'connectionGraph'].every(one => info.capabilities.includes(one)), info);
await advertised;
check('serverInfo precedes the channels', seen.order[0] === 'serverInfo', seen.order);
const sine = channels.get('/sine'), total = channels.get('/total');
check('a channel has a JSON schema', sine.encoding === 'json' && sine.schemaEncoding === 'jsonschema' && JSON.parse(sine.schema).properties.value.type === 'number', sine);
check('a bit is a boolean', JSON.parse(channels.get('/high').schema).properties.value.type === 'boolean', channels.get('/high'));

const values = [], bits = [], subscription = client.subscribe(sine.id), high = client.subscribe(channels.get('/high').id), decoder = new TextDecoder();
client.on('message', ({subscriptionId, timestamp, data}) => {
  const value = JSON.parse(decoder.decode(data)).value;
  if (subscriptionId === subscription) values.push([timestamp, value]);
  if (subscriptionId === high) bits.push([timestamp, value]);
});
const wait = async good => { while (!good()) await new Promise(resolve => setTimeout(resolve, 20)); };
await wait(() => values.length >= 100);
check('values follow the wave', Math.max(...values.map(([, v]) => v)) > 0.9 && Math.min(...values.map(([, v]) => v)) < -0.9, values.slice(0, 5));
check('stamps increase', values.every(([t], i) => i === 0 || t > values[i - 1][0]), values.slice(0, 5).map(([t]) => String(t)));
check('stamps are Unix time', Math.abs(Number(values.at(-1)[0]) / 1e6 - Date.now()) < 60000, String(values.at(-1)[0]));
check('the time precedes each message', values.every(([t]) => seen.times.includes(t)) && seen.times.every((t, i) => i === 0 || t >= seen.times[i - 1]), seen.times.length);
const at = new Map(bits.map(([t, v]) => [t, v])), pairs = values.filter(([t]) => at.has(t));
check('values of one stamp are of one cycle', pairs.length > 20 && pairs.every(([t, v]) => at.get(t) === v > 0 || v === 0), pairs.length);
client.unsubscribe(subscription);
client.unsubscribe(high);
const more = client.subscribe(total.id), next = () => once('message', message => message.subscriptionId === more);
await next();
const before = values.length;  // the server has handled the requests
for (let i = 0; i < 5; i++) await next();
check('an unsubscribed channel is no longer sent', values.length === before, values.length - before);

const answer = (names, id) => { const reply = once('parameterValues', given => given.id === id); client.getParameters(names, id); return reply; };
const all = await answer([], 'all');
check('all parameters are listed', all.parameters.some(({name: one}) => one === 'wave.update.tmax') || all.parameters.length > 0, all.parameters.length);
const written = once('parameterValues', given => given.id === 'set');
client.setParameters([{name: 'wave.frequency', value: 7.5, type: 'float64'}], 'set');
const now = (await written).parameters[0];
check('a parameter is set', now.name === 'wave.frequency' && now.value === 7.5 && now.type === 'float64', now);
const graph = once('connectionGraphUpdate');
client.subscribeConnectionGraph();
const links = await graph;
check('the graph has writers and readers', links.publishedTopics.some(one => one.name === '/sine' && one.publisherIds.includes('wave')) &&
  links.subscribedTopics.some(one => one.name === '/sine' && one.subscriberIds.includes('above')), links);
client.close();
clearTimeout(late);
process.exit(failed ? 1 : 0);
