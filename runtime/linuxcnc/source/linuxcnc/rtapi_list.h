/* SPDX-License-Identifier: MIT */
/* Circular doubly linked lists: a head, and a link in each element. Nothing is allocated. [any],
 * not synchronised */
#ifndef HALCYON_RTAPI_LIST_H
#define HALCYON_RTAPI_LIST_H

#include <stddef.h>

struct rtapi_list_head {
    struct rtapi_list_head *next, *prev;
};

#define RTAPI_LIST_HEAD_INIT(name) {&(name), &(name)}
#define RTAPI_LIST_HEAD(name) struct rtapi_list_head name = RTAPI_LIST_HEAD_INIT(name)
#define RTAPI_INIT_LIST_HEAD(head) rtapi_list_init(head)

static inline void rtapi_list_init(struct rtapi_list_head* head) { head->next = head->prev = head; }

/* Puts `link` between two neighbours. */
static inline void rtapi_list_insert_between(struct rtapi_list_head* link,
                                             struct rtapi_list_head* before,
                                             struct rtapi_list_head* behind) {
    link->prev = before;
    link->next = behind;
    before->next = link;
    behind->prev = link;
}

/* Puts `link` first, or last. */
static inline void rtapi_list_add(struct rtapi_list_head* link, struct rtapi_list_head* head) {
    rtapi_list_insert_between(link, head, head->next);
}
static inline void rtapi_list_add_tail(struct rtapi_list_head* link, struct rtapi_list_head* head) {
    rtapi_list_insert_between(link, head->prev, head);
}

/* Takes `link` out. It stays a list of its own, so that taking it out again does no harm. */
static inline void rtapi_list_del(struct rtapi_list_head* link) {
    link->prev->next = link->next;
    link->next->prev = link->prev;
    rtapi_list_init(link);
}

static inline int rtapi_list_empty(const struct rtapi_list_head* head) {
    return head->next == head;
}

/* The structure of type `type` whose member `member` is at `pointer`. */
#define rtapi_container_of(pointer, type, member) \
    ((type*)(void*)((char*)(pointer) - offsetof(type, member)))
/* The element of type `type` whose member `member` is the link. */
#define rtapi_list_entry(link, type, member) rtapi_container_of(link, type, member)

#define rtapi_list_for_each(at, head) for (at = (head)->next; at != (head); at = at->next)
/* `at` may be taken out meanwhile; `after` is another variable of its type. */
#define rtapi_list_for_each_safe(at, after, head) \
    for (at = (head)->next, after = at->next; at != (head); at = after, after = at->next)

#endif
