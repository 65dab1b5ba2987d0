// SPDX-License-Identifier: MIT
// One running machine: the model and its transactions, the threads, the values, the plugin host,
// the programs and the reports (docs/design.md). Only the command language, the tools and tests use
// it.
//
//   Session session;
//   const auto lock = session.lock();
//   Transaction transaction = session.begin();          // the only way to change the model
//   ... transaction.apply(form, command, diagnostics);
//   if (transaction.commit(diagnostics)) session.threads().start();
//   const auto reading = session.values().read({"pid.0.output"})[0];
//
// Every member of the session and of its parts is [setup] and is called with lock() held, unless it
// is marked otherwise.
#pragma once

#include <memory>

#include "machine/run/running_model.hpp"

namespace hal {

class Programs;

class Session : public RunningModel {
public:
    explicit Session(SessionOptions options = {});
    /// Ends all programs that loadusr started, then shut_down(). Takes the lock.
    ~Session();

    Programs& programs() { return *programs_; }

private:
    std::unique_ptr<Programs> programs_;
};

}  // namespace hal
