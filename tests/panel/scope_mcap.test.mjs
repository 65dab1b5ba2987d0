// SPDX-License-Identifier: MIT
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {Store} from '../../tools/panel/page/scope_data.js';
import {mcap, messageName, rosName} from '../../tools/panel/page/scope_mcap.js';

const about = {
    instance: 'default',
    version: '1'
};

/// The records of a file as {opcode, content}, those of chunks in their place.
function records(bytes, at = 8, end = bytes.length - 8) {
    const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.length), all = [];
    while (at < end) {
        const opcode = view.getUint8(at), length = Number(view.getBigUint64(at + 1, true)),
              content = at + 9;
        if (opcode === 6)
            all.push(...records(bytes, content + 40, content + length));
        else
            all.push({opcode, content: bytes.subarray(content, content + length)});
        at = content + length;
    }
    return all;
}

const viewOf = ({content}) => new DataView(content.buffer, content.byteOffset, content.length);

test('names become fields and messages as those of hal record', () => {
    assert.equal(rosName('joint.0.pos-cmd'), 'joint_0_pos_cmd');
    assert.equal(rosName('0.x'), 'v_0_x');
    assert.equal(rosName('--'), 'v');
    assert.equal(messageName('servo-thread'), 'ServoThread');
    assert.equal(messageName('1fast2'), 'Fast2');
    assert.equal(messageName('1'), 'Values');
});

test('each row is a message with the cycle, Unix time and values, in the order of time', () => {
    const store = new Store();
    store.layout(
        [{columns: [0, 1], thread: 'servo', period_ns: 1e6}], ['ok', 'speed'],
        [{name: 'ok', type: 'bit', unit: ''}, {name: 'speed', type: 'float', unit: 'm/s'}]);
    store.origin = 5e9;
    store.unixOffset = 1e18;
    const [group] = store.groups;
    for (let i = 0; i < 3; i++) {
        const at = group.add(i / 1000, 40 + i);
        group.values[0][at] = i % 2;
        group.values[1][at] = i / 2;
    }
    store.newest = .002;
    const events = [{time_ns: 5.0015e9, kind: 'fault', text: 'servo: late'}];
    const file = mcap(store, ['speed', 'ok', 'unknown'], 0, 1, events, about);
    assert.deepEqual([...file.subarray(0, 5)], [0x89, 0x4d, 0x43, 0x41, 0x50]);
    const messages = records(file).filter(({opcode}) => opcode === 5).map(viewOf);
    const times = messages.map(view => view.getBigUint64(6, true));
    assert.deepEqual(
        times, [0n, 1000000n, 1500000n, 2000000n].map(t => t + 1000000005000000000n));
    assert.deepEqual(messages.map(view => view.getUint32(2, true)), [40, 41, 0, 42]);
    assert.equal(messages[1].getFloat64(22 + 4, true), .5);
    assert.equal(messages[1].getUint8(22 + 12), 1);
    const text = new TextDecoder().decode(file);
    for (const part of ['float64 speed\nbool ok\n', '/hal/servo', 'm/s', '"text":"servo: late"'])
        assert.ok(text.includes(part), part);
});

test('a file without samples is a complete one', () => {
    const opcodes = records(mcap(new Store(), ['v'], 0, 1, [], about)).map(one => one.opcode);
    assert.deepEqual(opcodes.slice(0, 3), [1, 12, 15]);
    assert.equal(opcodes[opcodes.length - 1], 2);
});
