/* SPDX-License-Identifier: MIT */
/* LD_PRELOAD: raw SocketCAN sockets where the kernel has no CAN. An interface whose name begins with "shim" is a UDP multicast group on the
   loopback interface; a datagram is a struct can_frame or canfd_frame and the sender's cookie (8 bytes), so that it is received where it
   belongs. Filters, and that a socket does not hear itself, are classic BPF on the UDP socket: poll and blocking reads stay exact. No
   broadcast manager, no error frames. */
#define _GNU_SOURCE
#include <arpa/inet.h>
#include <dlfcn.h>
#include <errno.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <linux/filter.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <netinet/in.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

enum { sockets = 1024, max_filters = 32, first_index = 0x10000, port = 43222, batch = 64 };

static struct can_socket {
    int there, hears_itself, filter_count;
    uint64_t cookie;
    struct sockaddr_in group;
    struct can_filter filters[max_filters];
} table[sockets];

/* The C library's function of that name, looked up once. */
#define REAL(name)                                                      \
    (__extension__({                                                    \
        static __typeof__(&name) real_;                                 \
        if (!real_) real_ = (__typeof__(&name))dlsym(RTLD_NEXT, #name); \
        real_;                                                          \
    }))

static struct can_socket* can_of(int fd) {
    return fd >= 0 && fd < sockets && table[fd].there ? &table[fd] : NULL;
}

static unsigned index_of(const char* name) {
    if (strncmp(name, "shim", 4) != 0) return 0;
    unsigned hash = 2166136261u;
    for (; *name; ++name) {
        hash = (hash ^ (unsigned char)*name) * 16777619u;
    }
    return first_index + (hash & 0xffff);
}

/* The payload begins behind the 8 bytes of the UDP header, with the identifier; the cookie is at its end. Words are loaded big endian. */
static void attach(int fd) {
    const struct can_socket* s = &table[fd];
    struct sock_filter code[12 + 3 * max_filters];
    unsigned n = 0, i;
    uint32_t word[2];
    memcpy(word, &s->cookie, 8);
    if (!s->hears_itself) {
        code[n++] = (struct sock_filter)BPF_STMT(BPF_LD | BPF_W | BPF_LEN, 0);
        code[n++] = (struct sock_filter)BPF_STMT(BPF_ALU | BPF_SUB | BPF_K, 8);
        code[n++] = (struct sock_filter)BPF_STMT(BPF_MISC | BPF_TAX, 0);
        code[n++] = (struct sock_filter)BPF_STMT(BPF_LD | BPF_W | BPF_IND, 0);
        code[n++] = (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, ntohl(word[0]), 0, 3);
        code[n++] = (struct sock_filter)BPF_STMT(BPF_LD | BPF_W | BPF_IND, 4);
        code[n++] = (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, ntohl(word[1]), 0, 1);
        code[n++] = (struct sock_filter)BPF_STMT(BPF_RET | BPF_K, 0);
    }
    for (i = 0; i < (unsigned)s->filter_count; ++i) {
        code[n++] = (struct sock_filter)BPF_STMT(BPF_LD | BPF_W | BPF_ABS, 8);
        code[n++] =
            (struct sock_filter)BPF_STMT(BPF_ALU | BPF_AND | BPF_K, ntohl(s->filters[i].can_mask));
        code[n] = (struct sock_filter)BPF_JUMP(
            BPF_JMP | BPF_JEQ | BPF_K, ntohl(s->filters[i].can_id & s->filters[i].can_mask), 0, 0);
        code[n++].jt =
            (unsigned char)(3 * (s->filter_count - 1 - (int)i) + 1); /* to the accepting end */
    }
    if (s->filter_count > 0) {
        code[n++] = (struct sock_filter)BPF_STMT(BPF_RET | BPF_K, 0);
    }
    code[n++] = (struct sock_filter)BPF_STMT(BPF_RET | BPF_K, 0xffff);
    const struct sock_fprog program = {(unsigned short)n, code};
    REAL(setsockopt)(fd, SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof program);
}

int socket(int domain, int type, int protocol) {
    if (domain != AF_CAN) return REAL(socket)(domain, type, protocol);
    if (protocol != CAN_RAW) {
        errno = EPROTONOSUPPORT;
        return -1;
    }
    const int fd = REAL(socket)(AF_INET, SOCK_DGRAM | (type & (SOCK_NONBLOCK | SOCK_CLOEXEC)), 0);
    if (fd < 0 || fd >= sockets) return fd;
    memset(&table[fd], 0, sizeof table[fd]);
    table[fd].there = 1;
    (void)!syscall(SYS_getrandom, &table[fd].cookie, 8, 0);
    const int yes = 1;
    REAL(setsockopt)(fd, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    return fd;
}

int close(int fd) {
    if (can_of(fd)) {
        table[fd].there = 0;
    }
    return REAL(close)(fd);
}

int bind(int fd, const struct sockaddr* address, socklen_t size) {
    struct can_socket* s = can_of(fd);
    if (!s || address->sa_family != AF_CAN) return REAL(bind)(fd, address, size);
    const unsigned index = (unsigned)((const struct sockaddr_can*)address)->can_ifindex;
    if (index < first_index) {
        errno = ENODEV;
        return -1;
    }
    s->group.sin_family = AF_INET;
    s->group.sin_port = htons(port);
    s->group.sin_addr.s_addr = htonl(0xef4d0000u | (index & 0xffff)); /* 239.77.… */
    const int lo = (int)if_nametoindex("lo");
    struct ip_mreqn join = {s->group.sin_addr, {0}, lo};
    attach(fd);
    if (REAL(setsockopt)(fd, IPPROTO_IP, IP_ADD_MEMBERSHIP, &join, sizeof join) < 0) return -1;
    if (REAL(setsockopt)(fd, IPPROTO_IP, IP_MULTICAST_IF, &join, sizeof join) < 0) return -1;
    return REAL(bind)(fd, (const struct sockaddr*)&s->group, sizeof s->group);
}

int setsockopt(int fd, int level, int name, const void* value, socklen_t size) {
    struct can_socket* s = can_of(fd);
    if (!s || level != SOL_CAN_RAW) return REAL(setsockopt)(fd, level, name, value, size);
    if (name == CAN_RAW_RECV_OWN_MSGS) {
        s->hears_itself = *(const int*)value;
    }
    if (name == CAN_RAW_FILTER) {
        s->filter_count = (int)(size / sizeof(struct can_filter));
        if (s->filter_count > max_filters) {
            s->filter_count = max_filters;
        }
        memcpy(s->filters, value, (size_t)s->filter_count * sizeof(struct can_filter));
    }
    attach(fd);
    return 0;
}

unsigned if_nametoindex(const char* name) {
    const unsigned index = index_of(name);
    return index ? index : REAL(if_nametoindex)(name);
}

int ioctl(int fd, unsigned long request, ...) {
    va_list arguments;
    va_start(arguments, request);
    void* const argument = va_arg(arguments, void*);
    va_end(arguments);
    struct ifreq* const about = argument;
    if (request == SIOCGIFINDEX && index_of(about->ifr_name)) {
        about->ifr_ifindex = (int)index_of(about->ifr_name);
        return 0;
    }
    return REAL(ioctl)(fd, request, argument);
}

/* A question for one of our interfaces over rtnetlink: the socket becomes one that holds the answer. */
static int answered(int fd, const void* data, size_t size) {
    const struct nlmsghdr* ask = data;
    if (size < NLMSG_LENGTH(sizeof(struct ifinfomsg)) + sizeof(struct rtattr) ||
        ask->nlmsg_type != RTM_GETLINK) {
        return 0;
    }
    const struct ifinfomsg* info = NLMSG_DATA(ask);
    const struct rtattr* a = IFLA_RTA(info);
    if (a->rta_type != IFLA_IFNAME || !index_of(RTA_DATA(a))) return 0;
    struct {
        struct nlmsghdr header;
        struct ifinfomsg info;
        struct rtattr mtu;
        uint32_t mtu_value;
    } out = {
        {sizeof out, RTM_NEWLINK, 0, ask->nlmsg_seq, 0}, {0}, {RTA_LENGTH(4), IFLA_MTU}, CANFD_MTU};
    out.info.ifi_type = ARPHRD_CAN;
    out.info.ifi_index = (int)index_of(RTA_DATA(a));
    out.info.ifi_flags = IFF_UP | IFF_RUNNING;
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0, ends) < 0) return 0;
    (void)!REAL(write)(ends[1], &out, sizeof out);
    dup2(ends[0], fd);
    REAL(close)(ends[0]);
    REAL(close)(ends[1]);
    return 1;
}

static ssize_t send_parts(int fd, struct can_socket* s, const struct iovec* part, int flags) {
    struct iovec all[2] = {*part, {&s->cookie, 8}};
    const struct msghdr message = {&s->group, sizeof s->group, all, 2, NULL, 0, 0};
    const ssize_t sent = REAL(sendmsg)(fd, &message, flags);
    return sent < 8 ? sent : sent - 8;
}

ssize_t write(int fd, const void* data, size_t size) {
    struct can_socket* s = can_of(fd);
    const struct iovec part = {(void*)(uintptr_t)data, size};
    return s ? send_parts(fd, s, &part, 0) : REAL(write)(fd, data, size);
}
ssize_t send(int fd, const void* data, size_t size, int flags) {
    struct can_socket* s = can_of(fd);
    const struct iovec part = {(void*)(uintptr_t)data, size};
    if (s) return send_parts(fd, s, &part, flags);
    return answered(fd, data, size) ? (ssize_t)size : REAL(send)(fd, data, size, flags);
}
ssize_t sendmsg(int fd, const struct msghdr* message, int flags) {
    struct can_socket* s = can_of(fd);
    return s ? send_parts(fd, s, message->msg_iov, flags) : REAL(sendmsg)(fd, message, flags);
}
int sendmmsg(int fd, struct mmsghdr* messages, unsigned count, int flags) {
    struct can_socket* s = can_of(fd);
    if (!s) return REAL(sendmmsg)(fd, messages, count, flags);
    struct mmsghdr all[batch];
    struct iovec parts[batch][2];
    if (count > batch) {
        count = batch;
    }
    for (unsigned n = 0; n < count; ++n) {
        parts[n][0] = messages[n].msg_hdr.msg_iov[0];
        parts[n][1] = (struct iovec){&s->cookie, 8};
        all[n] = (struct mmsghdr){{&s->group, sizeof s->group, parts[n], 2, NULL, 0, 0}, 0};
    }
    const int sent = REAL(sendmmsg)(fd, all, count, flags);
    for (int n = 0; n < sent; ++n) {
        messages[n].msg_len = all[n].msg_len - 8;
    }
    return sent;
}

/* Of what was received into `buffer`: the frame's size; the cookie, where space allows, names the sender. */
static size_t frame_size(const struct can_socket* s, size_t got, const void* buffer, int* flags) {
    const size_t frame = got >= CANFD_MTU ? CANFD_MTU : got >= CAN_MTU ? CAN_MTU : got;
    if (s->hears_itself && got == frame + 8 &&
        memcmp((const char*)buffer + frame, &s->cookie, 8) == 0) {
        *flags |= MSG_CONFIRM | MSG_DONTROUTE;
    }
    *flags &= ~MSG_TRUNC;
    return frame;
}
ssize_t recvmsg(int fd, struct msghdr* message, int flags) {
    const struct can_socket* s = can_of(fd);
    const ssize_t got = REAL(recvmsg)(fd, message, flags);
    return s && got > 0 ? (ssize_t)frame_size(s, (size_t)got, message->msg_iov[0].iov_base,
                                              &message->msg_flags)
                        : got;
}
ssize_t recv(int fd, void* data, size_t size, int flags) {
    const struct can_socket* s = can_of(fd);
    const ssize_t got = REAL(recv)(fd, data, size, flags);
    int ignored = 0;
    return s && got > 0 ? (ssize_t)frame_size(s, (size_t)got, data, &ignored) : got;
}
ssize_t read(int fd, void* data, size_t size) {
    return can_of(fd) ? recv(fd, data, size, 0) : REAL(read)(fd, data, size);
}
int recvmmsg(int fd, struct mmsghdr* messages, unsigned count, int flags, struct timespec* limit) {
    const struct can_socket* s = can_of(fd);
    const int got = REAL(recvmmsg)(fd, messages, count, flags, limit);
    for (int n = 0; s && n < got; ++n) {
        messages[n].msg_len =
            (unsigned)frame_size(s, messages[n].msg_len, messages[n].msg_hdr.msg_iov[0].iov_base,
                                 &messages[n].msg_hdr.msg_flags);
    }
    return got;
}
