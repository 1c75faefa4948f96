// A widget of Qt 6 with a panel of properties beside it: qt_widget FILE.vcp [--frames N]. X11, natively or through
// XWayland (QT_QPA_PLATFORM=xcb).
#include <QtWidgets>

#include <cstdio>

#include <vcp/vcp_qt.hpp>

using namespace vcp::widget;

int main(int argc, char** argv) {
    QApplication app(argc, argv);
    const QStringList arguments = app.arguments();
    if (arguments.size() < 2) return std::fprintf(stderr, "usage: qt_widget FILE.vcp [--frames N]\n"), 1;
    const int frames = arguments.size() > 3 && arguments[2] == "--frames" ? arguments[3].toInt() : -1;
    try {
        vcp_context_options options = sized<vcp_context_options>();
        options.windows = 1;
        Context context(options);
        context.open(arguments[1].toStdString());

        auto* scene = new QtView(context);
        QWidget main;
        auto* layout = new QHBoxLayout(&main);
        auto* panel = new QFormLayout;
        layout->addWidget(QWidget::createWindowContainer(scene), 1);
        layout->addLayout(panel);
        auto* shading = new QComboBox;
        shading->addItems({"lit", "clay", "unlit", "normals", "steps", "cells", "fetches", "level", "error"});
        auto* shadows = new QCheckBox;
        auto* status = new QLabel;
        panel->addRow("Shading", shading);
        panel->addRow("Shadows", shadows);
        panel->addRow("Status", status);
        const auto change = [=] {
            scene->change([=](View& view) {
                vcp_look look = view.look();
                look.shading = shading->currentIndex();
                look.shadows = shadows->isChecked() ? 1 : 0;
                view.setLook(look);
            });
        };
        QObject::connect(shading, &QComboBox::currentIndexChanged, change);
        QObject::connect(shadows, &QCheckBox::toggled, change);
        scene->failed = [](const std::exception& e) {
            std::fprintf(stderr, "%s\n", e.what());
            exit(1);
        };
        scene->drawn = [&](const vcp_stats& stats) {
            status->setText(QString("%1 pages, %2 ms").arg(stats.pages_drawn).arg(stats.frame_ms, 0, 'f', 1));
            if (frames >= 0 && stats.settled && stats.hit_pixels > 0 && stats.frames >= uint64_t(frames)) {
                std::printf("%llu frames, %llu pixels show the surface\n", (unsigned long long)stats.frames,
                            (unsigned long long)stats.hit_pixels);
                app.quit();
            } else if (frames >= 0) {
                shadows->toggle();  // something to draw
            }
        };
        main.resize(800, 500);
        main.show();
        return app.exec();
    } catch (const std::exception& e) {
        std::fprintf(stderr, "%s\n", e.what());
        return 1;
    }
}
