// SPDX-License-Identifier: MIT
#include "unit/components/component_host.hpp"

#include <dlfcn.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <new>

#include "paths.hpp"

namespace hal::test {

namespace {

Instance& instance_of(const hal_host* host) { return *static_cast<Instance*>(host->data); }

void* zeroed(std::size_t bytes, std::size_t align) {
    void* memory = ::operator new(std::max<std::size_t>(bytes, 1), std::align_val_t{align});
    return std::memset(memory, 0, bytes);
}

}  // namespace

std::string plugin_file(const std::string& component) {
    std::string searched = std::string(paths::build_components);
    if (const char* path = std::getenv("HALCYON_PLUGIN_PATH")) {
        searched = std::string(path) + ":" + searched;
    }
    for (std::size_t begin = 0; begin <= searched.size();) {
        const std::size_t end = std::min(searched.find(':', begin), searched.size());
        const std::string file = searched.substr(begin, end - begin) + "/" + component + ".so";
        if (access(file.c_str(), R_OK) == 0) return file;
        begin = end + 1;
    }
    throw std::runtime_error("no plugin '" + component + "' in " + searched);
}

Instance::Instance(const std::string& component, Arguments arguments, Extensions extensions,
                   Life life)
    : arguments_(std::move(arguments)), extensions_(std::move(extensions)) {
    host_.size = sizeof host_;
    host_.data = this;
    host_.pin = [](const hal_host* host, const hal_pin_decl* decl, hal_pin* memory) {
        Instance& i = instance_of(host);
        if (!i.index_.emplace(decl->name, i.pins_.size()).second) {
            i.reason_ = std::string("two pins '") + decl->name + "'";
            return false;
        }
        i.pins_.push_back({decl->name, decl->doc, decl->unit, decl->type, decl->dir, decl->flags,
                           decl->initial, decl->safe, decl->function, memory});
        return true;
    };
    host_.function = [](const hal_host* host, const hal_function_decl* decl) {
        instance_of(host).functions_.push_back(
            {decl->name, decl->doc, decl->flags, decl->step, decl->self});
        return true;
    };
    host_.argument = [](const hal_host* host, const hal_argument_decl* decl) {
        const Arguments& given = instance_of(host).arguments_;
        const auto at = given.find(decl->name);
        return at == given.end() ? decl->fallback : at->second.c_str();
    };
    host_.allocate = [](const hal_host* host, std::size_t bytes, std::size_t align) {
        return instance_of(host).allocations_.emplace_back(zeroed(bytes, align), align).first;
    };
    host_.fail = [](const hal_host* host, const char* reason) {
        instance_of(host).reason_ = reason;
    };
    host_.extension = [](const hal_host* host, const char* id) -> const void* {
        const Extensions& known = instance_of(host).extensions_;
        const auto at = known.find(id);
        return at == known.end() ? nullptr : at->second;
    };

    const std::string file = plugin_file(component);
    library_ = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (library_ == nullptr) throw std::runtime_error(dlerror());
    component_ = static_cast<const hal_component*>(dlsym(library_, "hal_plugin"));
    if (component_ == nullptr) throw std::runtime_error(file + " exports no hal_plugin");
    self_ = allocations_
                .emplace_back(zeroed(component_->instance_size, component_->instance_align),
                              component_->instance_align)
                .first;
    if (!component_->create(&host_, self_)) {
        release();
        throw std::runtime_error(reason_);
    }
    if (life == Life::created) return;
    try {
        start();
    } catch (...) {
        component_->destroy(self_);
        release();
        throw;
    }
}

Instance::~Instance() {
    stop();
    component_->destroy(self_);
    release();
}

void Instance::release() {
    for (const auto& [memory, align] : allocations_) {
        ::operator delete(memory, std::align_val_t{align});
    }
    dlclose(library_);
}

void Instance::run(std::string_view name, std::int64_t period_ns, std::uint64_t cycles) {
    const Function& chosen = function(name);
    cycle_.period_ns = period_ns;
    cycle_.period_s = static_cast<double>(period_ns) * 1e-9;
    for (; cycles > 0; --cycles) {
        chosen.step(chosen.self, &cycle_);
        cycle_.start_ns += period_ns;
        ++cycle_.number;
    }
}

void Instance::link(std::string_view name) {
    hal_pin* memory = pin(name).memory;
    signals_[memory] = std::make_shared<hal_value>(*memory->slot);
    memory->slot = signals_[memory].get();
}

void Instance::link(std::string_view name, Instance& other, std::string_view other_pin) {
    const Pin& here = pin(name);
    const Pin& there = other.of_type(other_pin, here.type);
    if (!signals_.contains(here.memory)) {
        link(name);
    }
    other.signals_[there.memory] = signals_[here.memory];
    there.memory->slot = signals_[here.memory].get();
}

void Instance::unlink(std::string_view name) {
    hal_pin* memory = pin(name).memory;
    memory->own = *memory->slot;
    memory->slot = &memory->own;
    signals_.erase(memory);
}

void Instance::stop() {
    if (started_) {
        component_->stop(self_);
    }
    started_ = false;
}

void Instance::start() {
    if (!started_) {
        started_ = component_->start(self_, &host_);
    }
    if (!started_) throw std::runtime_error(reason_);
}

bool Instance::has_pin(std::string_view name) const { return index_.find(name) != index_.end(); }

const Instance::Pin& Instance::pin(std::string_view name) const {
    const auto at = index_.find(name);
    if (at == index_.end()) {
        throw std::runtime_error(std::string(component_->name) + " has no pin '" +
                                 std::string(name) + "'");
    }
    return pins_[at->second];
}

const Instance::Pin& Instance::of_type(std::string_view name, hal_type type) const {
    const Pin& found = pin(name);
    if (found.type != type) {
        throw std::runtime_error("pin '" + std::string(name) + "' has another type");
    }
    return found;
}

const Instance::Function& Instance::function(std::string_view name) const {
    const auto at = std::find_if(functions_.begin(), functions_.end(),
                                 [&](const Function& f) { return f.name == name; });
    if (at == functions_.end()) {
        throw std::runtime_error(std::string(component_->name) + " has no function '" +
                                 std::string(name) + "'");
    }
    return *at;
}

}  // namespace hal::test
