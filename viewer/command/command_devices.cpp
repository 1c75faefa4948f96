// vcp devices: what Vulkan offers here, the host beside it, and which of them vcp would take for a picture.
#include <optional>

#include <fmt/format.h>

#include "render/host_renderer.h"
#include "viewer/command/commands.h"

namespace vcp {

namespace {

struct DevicesCommand {
    std::string device;
    ReportOptions report;
};

struct DeviceList {
    std::vector<DeviceInfo> vulkan;
    std::optional<Error> problem;  ///< why there are none of Vulkan
    DeviceInfo host = hostDevice();
};

/// Errors: Device, where `choice` names none.
Result<DeviceList> devicesFor(const std::string& choice) {
    DeviceList list;
    list.host.chosen = isHostName(choice);
    auto devices = listDevices(list.host.chosen ? std::string() : choice);
    if (devices) {
        list.vulkan = *std::move(devices);
        for (DeviceInfo& device : list.vulkan) device.chosen = device.chosen && !list.host.chosen;
        return list;
    }
    if (!choice.empty() && !list.host.chosen) return devices.error();
    list.problem = devices.error();
    list.host.chosen = true;
    return list;
}

Json toJson(const DeviceInfo& device) {
    return {{"name", device.name},     {"type", device.type},     {"software", device.software},
            {"driver", device.driver}, {"usable", device.usable}, {"chosen", device.chosen}};
}

/// The host has no index: it is called by its name.
Json toJson(const DeviceList& list) {
    Json devices = Json::array();
    for (const DeviceInfo& device : list.vulkan) {
        devices.push_back(toJson(device));
        devices.back()["index"] = device.index;
    }
    devices.push_back(toJson(list.host));
    Json json{{"devices", devices}};
    if (list.problem) json["problem"] = list.problem->line();
    return json;
}

std::string table(const DeviceList& list) {
    std::string text;
    for (const DeviceInfo& device : list.vulkan) {
        text += fmt::format("{} {}  {}: {}, driver {}", device.chosen ? '*' : ' ', device.index, device.name,
                            device.type, device.driver);
        if (device.software) text += "; software: runs on the processor, not on a graphics card";
        if (!device.usable) text += "; not usable: needs Vulkan 1.2 and a compute queue";
        text += '\n';
    }
    text += fmt::format("{} -  {}: cpu, {}; software: draws pictures on the processor, without Vulkan\n",
                        list.host.chosen ? '*' : ' ', list.host.name, list.host.driver);
    if (list.problem) text += fmt::format("no Vulkan, which windows need: {}\n", list.problem->line());
    return text + "* is the one that vcp takes; --device takes another";
}

Result<int> run(const DevicesCommand& command) {
    VCP_TRY_ASSIGN(const auto list, devicesFor(command.device));
    if (command.report.json)
        VCP_TRY(printJson(toJson(list)));
    else
        VCP_TRY(printLine(table(list)));
    return 0;
}

}  // namespace

Command addDevices(CLI::App& vcp) {
    auto command = std::make_shared<DevicesCommand>();
    CLI::App* app = vcp.add_subcommand(
        "devices", "List the Vulkan devices, software ones named as such, and the host, which needs no Vulkan");
    app->add_option("--device", command->device,
                    "Say which device this choice takes: an index, a part of a name, or host")
        ->type_name("DEVICE");
    addJsonOption(*app, command->report);
    return {app, [command] { return run(*command); }};
}

}  // namespace vcp
