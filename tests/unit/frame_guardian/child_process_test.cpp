// SPDX-License-Identifier: MIT
// A guardian that does not start: why, and that nothing of it remains.
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <new>
#include <string>
#include <vector>

#include "bus/guardian/child_process.hpp"

namespace hal::bus {
namespace {

/// A process in the place of a guardian, with the memory of one.
struct FailedStart : testing::Test {
    void SetUp() override {
        ASSERT_EQ(child_.map(sizeof(StartState), "text"), "");
        state_ = new (child_.memory()) StartState;
    }
    void TearDown() override {
        EXPECT_FALSE(child_.is_running());
        EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1) << "a process remains";
        EXPECT_EQ(errno, ECHILD);
    }
    std::string start(std::vector<std::string> arguments) {
        return child_.start(std::move(arguments), *state_, -1);
    }

    ChildProcess child_;
    StartState* state_ = nullptr;
};

TEST_F(FailedStart, Of_a_guardian_that_ends_at_once) {
    EXPECT_EQ(start({"/bin/true"}), "the guardian has ended during its start");
}

TEST_F(FailedStart, Of_a_guardian_that_never_watches) {
    EXPECT_EQ(start({"/bin/sleep", "100"}), "the guardian did not start within 3 s");
}

TEST_F(FailedStart, Of_a_program_that_does_not_exist) {
    EXPECT_EQ(start({"/missing/guardian"}),
              "cannot start the guardian '/missing/guardian': No such file or directory");
}

/// All descriptors but three, which the start of a guardian takes for its memory, text and lock.
class FewDescriptors {
public:
    FewDescriptors() {
        getrlimit(RLIMIT_NOFILE, &before_);
        rlimit few = before_;
        few.rlim_cur = 64;
        setrlimit(RLIMIT_NOFILE, &few);
        for (int number = 0; number >= 0; number = ::open("/dev/null", O_RDONLY | O_CLOEXEC)) {
            if (number != 0) {
                taken_.push_back(number);
            }
        }
        for (int n = 0; n < 3; ++n) {
            ::close(taken_.back());
            taken_.pop_back();
        }
    }
    ~FewDescriptors() {
        for (const int number : taken_) {
            ::close(number);
        }
        setrlimit(RLIMIT_NOFILE, &before_);
    }

private:
    rlimit before_{};
    std::vector<int> taken_;
};

TEST_F(FailedStart, Of_a_guardian_for_whose_end_no_descriptor_is_left) {
    const FewDescriptors few;
    EXPECT_EQ(start({"/bin/sleep", "100"}), "cannot watch the guardian: Too many open files");
}

}  // namespace
}  // namespace hal::bus
