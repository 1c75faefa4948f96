// The arena of the calling thread.
#pragma once

namespace tbb {

class task_arena {
public:
    static constexpr int automatic = -1;
    explicit task_arena(int) {}
    template <class Task>
    void execute(const Task& task) {
        task();
    }
};

}  // namespace tbb
