// SPDX-License-Identifier: MIT
#include "model/names.hpp"

#include "model/model.hpp"

namespace hal {
namespace {

template <class T>
std::shared_ptr<const NameIndex> indexed(const NameTable<T>& names, const std::stop_token& stop) {
    auto index = std::make_shared<NameIndex>();
    for (const auto& [name, object] : names) {
        if (stop.stop_requested()) return nullptr;
        index->add(name, object->id);
    }
    return index;
}

std::size_t size_of(const Model& model, NameGroup group) {
    switch (group) {
    case NameGroup::pins: return model.pin.size();
    case NameGroup::signals: return model.signal.size();
    case NameGroup::functions: break;
    }
    return model.function.size();
}

std::shared_ptr<const NameIndex> indexed(const Model& model, NameGroup group,
                                         const std::stop_token& stop) {
    switch (group) {
    case NameGroup::pins: return indexed(model.pin, stop);
    case NameGroup::signals: return indexed(model.signal, stop);
    case NameGroup::functions: break;
    }
    return indexed(model.function, stop);
}

}  // namespace

std::shared_ptr<const NameIndex> ModelNames::get(const Model& model, NameGroup group,
                                                 const std::stop_token& stop) {
    Taken& taken = taken_[static_cast<std::size_t>(group)];
    const std::size_t size = size_of(model, group);
    if (auto index = taken.index.lock();
        index && taken.size == size && taken.next_id == model.next_id) {
        return index;
    }
    auto index = indexed(model, group, stop);
    if (index) {
        taken = {index, size, model.next_id};
    }
    return index;
}

}  // namespace hal
