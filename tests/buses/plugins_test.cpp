// SPDX-License-Identifier: MIT
#include <dlfcn.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <fstream>
#include <iterator>
#include <string>

namespace {

/// Loaded as the runtime loads a plugin: from a copy in memory, its symbols for nobody else.
class Plugin {
public:
    explicit Plugin(const std::string& file) {
        std::ifstream in(file, std::ios::binary);
        const std::string text{std::istreambuf_iterator<char>(in), {}};
        copy_ = memfd_create("plugin", MFD_CLOEXEC);
        EXPECT_EQ(write(copy_, text.data(), text.size()), static_cast<ssize_t>(text.size()));
        library_ =
            dlopen(("/proc/" + std::to_string(getpid()) + "/fd/" + std::to_string(copy_)).c_str(),
                   RTLD_NOW | RTLD_LOCAL);
        EXPECT_NE(library_, nullptr) << dlerror();
    }
    ~Plugin() {
        dlclose(library_);
        close(copy_);  // not before: the number is part of the name the loader knows the plugin by
    }
    template <class Function>
    Function* get(const char* name) const {
        return reinterpret_cast<Function*>(dlsym(library_, name));
    }

private:
    int copy_ = -1;
    void* library_ = nullptr;
};

TEST(Plugins, meet_on_one_bus_although_they_hide_their_symbols) {
    const std::string folder = HALCYON_BUS_PLUGINS;
    const Plugin a(folder + "/bus_user_a.so");
    {
        const Plugin b(folder + "/bus_user_b.so");
        ASSERT_TRUE(a.get<bool(const char*)>("bus_user_open")("sim:shared"));
        ASSERT_TRUE(b.get<bool(const char*)>("bus_user_open")("sim:shared"));
        ASSERT_NE(a.get<void()>("bus_user_close"), b.get<void()>("bus_user_close"));
        b.get<void(std::uint32_t, std::int64_t)>("bus_user_send")(0x123, 1'000'000);
        EXPECT_EQ(a.get<std::uint32_t(std::int64_t)>("bus_user_receive")(2'000'000), 0x123U);
        b.get<void()>("bus_user_close")();
    }
    // b's code has gone, the bus has not
    a.get<void(std::uint32_t, std::int64_t)>("bus_user_send")(0x124, 3'000'000);
    EXPECT_EQ(a.get<std::uint32_t(std::int64_t)>("bus_user_receive")(4'000'000), 0U);
    a.get<void()>("bus_user_close")();
}

}  // namespace
