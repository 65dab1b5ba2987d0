// SPDX-License-Identifier: MIT
#include "panel/control_link.hpp"

#include <algorithm>
#include <fcntl.h>
#include <libwebsockets.h>
#include <nlohmann/json.hpp>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>
#include <vector>

#include "machine/processes/address.hpp"

namespace hal::tools {

ControlLink::~ControlLink() {
    if (!wsi_) return;
    lws_set_opaque_user_data(wsi_, nullptr);  // the event loop closes it at its next call
    lws_callback_on_writable(wsi_);
}

bool ControlLink::retry() {
    if (wsi_) return true;
    const std::string path = found_socket(instance_);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (path.size() >= sizeof address.sun_path) return false;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (fd < 0) return false;
    if (::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
        ::close(fd);
        return false;
    }
    lws_sock_file_fd_type descriptor{};
    descriptor.sockfd = fd;
    wsi_ = lws_adopt_descriptor_vhost(host_, LWS_ADOPT_SOCKET, descriptor, "control", nullptr);
    if (!wsi_) {
        return false;  // it has closed the socket
    }
    lws_set_opaque_user_data(wsi_, this);
    lws_set_timeout(wsi_, NO_PENDING_TIMEOUT, 0);
    in_.clear();
    out_.clear();
    searched_ = 0;
    greeted_ = paused_ = false;
    return true;
}

bool ControlLink::send(std::string_view line) {
    if (!wsi_ || !greeted_ || out_.size() + line.size() > max_waiting) return false;
    out_.append(line);
    out_ += '\n';
    lws_callback_on_writable(wsi_);
    return true;
}

void ControlLink::pause(bool on) {
    if (!wsi_ || paused_ == on) return;
    paused_ = on;
    lws_rx_flow_control(wsi_, on ? 0 : 1);
}

bool ControlLink::received(std::string_view bytes) {
    in_.append(bytes);
    return in_.size() <= max_line_length && receive_lines();
}

bool ControlLink::receive_lines() {
    std::size_t taken = 0;
    for (std::size_t end;
         (end = in_.find('\n', std::max(taken, searched_))) != std::string::npos;) {
        const std::string_view line = std::string_view(in_).substr(taken, end - taken);
        std::size_t bytes = 0;
        if (line.starts_with("{\"event\":\"samples\"")) {
            const auto head = nlohmann::json::parse(line, nullptr, false);
            bytes = head.is_object() ? head.value("bytes", std::size_t{0}) : 0;
            if (bytes > max_line_length) return false;
            if (in_.size() < end + 1 + bytes) {
                break;  // its payload is not complete
            }
        }
        if (!greeted_) {
            greeted_ = true;
            user_.machine_up(line);
        } else {
            user_.machine_line(line, std::string_view(in_).substr(end + 1, bytes));
        }
        taken = searched_ = end + 1 + bytes;
    }
    in_.erase(0, taken);
    searched_ = in_.find('\n') == std::string::npos ? in_.size() : 0;
    return true;
}

bool ControlLink::writeable() {
    if (out_.empty()) return true;
    const std::size_t size = std::min<std::size_t>(out_.size(), 65536);
    std::vector<unsigned char> buffer(LWS_PRE + size);
    std::copy_n(out_.begin(), size, buffer.begin() + LWS_PRE);
    if (lws_write(wsi_, buffer.data() + LWS_PRE, size, LWS_WRITE_RAW) < static_cast<int>(size)) {
        return false;
    }
    out_.erase(0, size);
    if (!out_.empty()) {
        lws_callback_on_writable(wsi_);
    }
    return true;
}

void ControlLink::closed() {
    const bool was = greeted_;
    wsi_ = nullptr;
    greeted_ = false;
    if (was) {
        user_.machine_down();
    }
}

}  // namespace hal::tools
