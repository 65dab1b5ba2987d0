// SPDX-License-Identifier: MIT
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {keep, lists} from '../../tools/panel/page/watch_lists.js';

/// The part of a browser's Storage that is used.
function storage(content = null, full = false) {
    return {
        getItem: () => content,
        setItem: (key, text) => {
            if (full) throw new Error('QuotaExceededError');
            content = text;
        }
    };
}

test('lists are kept by name, in natural order, replaced and removed', () => {
    const store = storage();
    assert.equal(lists(store).size, 0);
    assert.ok(keep(store, 'axis 10', ['a', 'b']));
    assert.ok(keep(store, 'axis 2', ['c']));
    assert.deepEqual([...lists(store)], [['axis 2', ['c']], ['axis 10', ['a', 'b']]]);
    assert.ok(keep(store, 'axis 2', ['d']));
    assert.ok(keep(store, 'axis 10', []));
    assert.deepEqual([...lists(store)], [['axis 2', ['d']]]);
});

test('damaged content is ignored, and a full storage reported', () => {
    assert.equal(lists(storage('{')).size, 0);
    assert.equal(lists(storage('null')).size, 0);
    assert.deepEqual([...lists(storage('{"good":["a"],"bad":7,"worse":[1]}')).keys()], ['good']);
    assert.equal(keep(storage(null, true), 'x', ['a']), false);
});
