// SPDX-License-Identifier: MIT
// A file that grows by records (lines, blocks of a capture) and always ends with a complete one,
// even on a full disk. [setup]
#pragma once

#include <cerrno>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace hal {

/// The file.
class RecordFile {
public:
    /// Creates or truncates the file; see error().
    explicit RecordFile(const std::string& path)
        : file_(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666)),
          error_(file_ < 0 ? errno : 0),
          owned_(true) {
        look();
    }
    /// Writes to a descriptor owned by the caller.
    explicit RecordFile(int descriptor) : file_(descriptor) { look(); }
    ~RecordFile() { close(); }
    RecordFile(const RecordFile&) = delete;
    RecordFile& operator=(const RecordFile&) = delete;

    /// Queues one record. Returns false, with errno set, when it or an earlier one could not be
    /// written.
    bool put(std::string_view record) {
        if (error_ != 0) return fail();
        waiting_ += record;
        ends_.push_back(waiting_.size());
        return waiting_.size() < max_waiting || flush();
    }
    /// Writes the queued records. Returns false, with errno set, on failure; the file then ends
    /// with its last complete record.
    bool flush() {
        if (error_ != 0) return fail();
        std::size_t done = 0;
        while (done < waiting_.size()) {
            const ssize_t n = ::write(file_, waiting_.data() + done, waiting_.size() - done);
            if (n < 0 && errno == EINTR) continue;
            if (n <= 0) {
                error_ = n < 0 ? errno : ENOSPC;
                break;
            }
            done += static_cast<std::size_t>(n);
        }
        std::size_t whole = 0;
        for (const std::size_t end : ends_) {
            if (end > done) break;
            whole = end;
            ++records_;
        }
        if (error_ != 0 && regular_ &&
            ::ftruncate(file_, begin_ + static_cast<off_t>(whole)) != 0) {
            whole = done;
        }
        begin_ += static_cast<off_t>(whole);
        waiting_.clear();
        ends_.clear();
        return error_ == 0 || fail();
    }
    /// Flushes and closes. Returns false when anything was lost.
    bool close() {
        flush();
        if (owned_ && file_ >= 0 && ::close(file_) != 0 && error_ == 0) {
            error_ = errno;
        }
        file_ = -1;
        owned_ = false;
        return error_ == 0;
    }
    int error() const { return error_; }  ///< errno of the first failure, or 0
    std::size_t records() const { return records_; }  ///< complete records in the file

private:
    static constexpr std::size_t max_waiting = 65536;
    bool fail() const {
        errno = error_;
        return false;
    }
    void look() {
        struct stat about{};
        regular_ = file_ >= 0 && ::fstat(file_, &about) == 0 && S_ISREG(about.st_mode);
        if (!regular_) return;
        const bool appends = (::fcntl(file_, F_GETFL) & O_APPEND) != 0;
        begin_ = appends ? about.st_size : ::lseek(file_, 0, SEEK_CUR);
    }
    int file_;
    int error_ = 0;
    bool owned_ = false;
    bool regular_ = false;
    off_t begin_ = 0;  ///< where waiting_ begins in the file
    std::size_t records_ = 0;
    std::string waiting_;
    std::vector<std::size_t> ends_;  ///< of the records in waiting_
};

}  // namespace hal
