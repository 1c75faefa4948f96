// vcp devices: what Vulkan offers here, and which device vcp would take.
#include <fmt/format.h>

#include "render/renderer.h"
#include "viewer/command/commands.h"

namespace vcp {

namespace {

struct DevicesCommand {
    std::string device;
    ReportOptions report;
};

Json toJson(const std::vector<DeviceInfo>& devices) {
    Json list = Json::array();
    for (const DeviceInfo& device : devices)
        list.push_back({{"index", device.index},
                        {"name", device.name},
                        {"type", device.type},
                        {"software", device.software},
                        {"driver", device.driver},
                        {"usable", device.usable},
                        {"chosen", device.chosen}});
    return {{"devices", list}};
}

std::string table(const std::vector<DeviceInfo>& devices) {
    std::string text;
    for (const DeviceInfo& device : devices) {
        text += fmt::format("{}{} {}  {}: {}, driver {}", text.empty() ? "" : "\n", device.chosen ? '*' : ' ',
                            device.index, device.name, device.type, device.driver);
        if (device.software) text += "; software: runs on the processor, not on a graphics card";
        if (!device.usable) text += "; not usable: needs Vulkan 1.2 and a compute queue";
    }
    return text + "\n* is the one that vcp takes; --device takes another";
}

Result<int> run(const DevicesCommand& command) {
    VCP_TRY_ASSIGN(const auto devices, listDevices(command.device));
    if (command.report.json)
        VCP_TRY(printJson(toJson(devices)));
    else
        VCP_TRY(printLine(table(devices)));
    return 0;
}

}  // namespace

Command addDevices(CLI::App& vcp) {
    auto command = std::make_shared<DevicesCommand>();
    CLI::App* app = vcp.add_subcommand("devices", "List the Vulkan devices, software ones named as such");
    app->add_option("--device", command->device, "Say which device this choice takes: an index or a part of a name")
        ->type_name("DEVICE");
    addJsonOption(*app, command->report);
    return {app, [command] { return run(*command); }};
}

}  // namespace vcp
