// SPDX-License-Identifier: MIT
#include "execute/stop_flag.hpp"

#include <new>

#include <sys/mman.h>

namespace hal {

StopFlag::StopFlag()
    : page_([] {
          void* const memory = mmap(nullptr, sizeof(Page), PROT_READ | PROT_WRITE,
                                    MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
          if (memory == MAP_FAILED) throw std::bad_alloc();
          // an old kernel does not know it
          [[maybe_unused]] const int unknown = madvise(memory, sizeof(Page), MADV_WIPEONFORK);
          return new (memory) Page;
      }()) {}

StopFlag::~StopFlag() { munmap(page_, sizeof(Page)); }

}  // namespace hal
