// A widget of Qt 6 with a panel of properties beside it: qt_widget FILE.vcp [--frames N]. X11, natively or through
// XWayland (QT_QPA_PLATFORM=xcb).
#include <QtWidgets>

#include <algorithm>
#include <cstdio>

#include <vcp/vcp.hpp>

using namespace vcp::widget;

/// The window that the view draws into; createWindowContainer makes a widget of it.
class Scene : public QWindow {
public:
    Scene(Context context) : context_(std::move(context)) {
        setSurfaceType(QSurface::VulkanSurface);
        connect(&timer_, &QTimer::timeout, this, [this] { turn(); });
        timer_.setSingleShot(true);
    }
    View* view() { return view_.get(); }
    void wake() { timer_.start(0); }
    std::function<void(const vcp_stats&)> drawn;

protected:
    void exposeEvent(QExposeEvent*) override {
        if (isExposed() && !view_) begin();
        if (view_) wake();
    }
    void resizeEvent(QResizeEvent*) override {
        if (view_) view_->resize(uint32_t(pixels(width())), uint32_t(pixels(height()))), wake();
    }
    void mousePressEvent(QMouseEvent* e) override {
        const Qt::KeyboardModifiers m = e->modifiers();
        if (view_)
            view_->press(buttonOf(e), pixels(e->position().x()), pixels(e->position().y()),
                         (m & Qt::ShiftModifier ? VCP_SHIFT : 0) | (m & Qt::ControlModifier ? VCP_CONTROL : 0)),
                wake();
    }
    void mouseMoveEvent(QMouseEvent* e) override {
        if (view_) view_->move(pixels(e->position().x()), pixels(e->position().y())), wake();
    }
    void mouseReleaseEvent(QMouseEvent* e) override {
        if (view_) view_->release(buttonOf(e)), wake();
    }
    void wheelEvent(QWheelEvent* e) override {
        if (view_)
            view_->scroll(pixels(e->position().x()), pixels(e->position().y()), e->angleDelta().y() / 120.0), wake();
    }
    void keyPressEvent(QKeyEvent* e) override { key(e, true); }
    void keyReleaseEvent(QKeyEvent* e) override { key(e, false); }
    bool event(QEvent* e) override {
        // The surface is destroyed with the native window, and the view before it.
        if (e->type() == QEvent::PlatformSurface && static_cast<QPlatformSurfaceEvent*>(e)->surfaceEventType() ==
                                                        QPlatformSurfaceEvent::SurfaceAboutToBeDestroyed)
            timer_.stop(), view_.reset();
        return QWindow::event(e);
    }

private:
    double pixels(double length) const { return length * devicePixelRatio(); }
    static vcp_button buttonOf(const QMouseEvent* e) {
        return e->button() == Qt::LeftButton ? VCP_LEFT : e->button() == Qt::RightButton ? VCP_RIGHT : VCP_MIDDLE;
    }
    void key(QKeyEvent* e, bool pressed) {
        if (view_ && !e->isAutoRepeat()) view_->key(uint32_t(e->key()), pressed), wake();
    }
    void begin() {
        auto* x11 = qGuiApp->nativeInterface<QNativeInterface::QX11Application>();
        if (!x11) qFatal("this example draws into X11 windows: QT_QPA_PLATFORM=xcb");
        vcp_view_options how = sized<vcp_view_options>();
        how.window_system = VCP_WINDOW_XCB;
        how.display = x11->connection();
        how.window = winId();
        how.width = uint32_t(pixels(width()));
        how.height = uint32_t(pixels(height()));
        how.moving_frame_ms = 50;
        how.move_seconds = 0.3;
        view_ = std::make_unique<View>(context_, how);
    }
    void turn() {
        const vcp_step step = view_->update();
        view_->render();
        if (drawn) drawn(view_->stats());
        if (step.wait_seconds < 1e6) timer_.start(std::max(1, int(1000 * step.wait_seconds)));
    }

    Context context_;
    std::unique_ptr<View> view_;
    QTimer timer_;
};

// An exception of an event's handler must not pass through Qt.
class Application : public QApplication {
public:
    using QApplication::QApplication;
    bool notify(QObject* receiver, QEvent* event) override {
        try {
            return QApplication::notify(receiver, event);
        } catch (const std::exception& e) {
            std::fprintf(stderr, "%s\n", e.what());
            exit(1);
            return false;
        }
    }
};

int main(int argc, char** argv) {
    Application app(argc, argv);
    const QStringList arguments = app.arguments();
    if (arguments.size() < 2) return std::fprintf(stderr, "usage: qt_widget FILE.vcp [--frames N]\n"), 1;
    const int frames = arguments.size() > 3 && arguments[2] == "--frames" ? arguments[3].toInt() : -1;
    try {
        vcp_context_options options = sized<vcp_context_options>();
        options.windows = 1;
        Context context(options);
        context.open(arguments[1].toStdString());

        auto* scene = new Scene(context);
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
            if (!scene->view()) return;
            vcp_look look = scene->view()->look();
            look.shading = shading->currentIndex();
            look.shadows = shadows->isChecked() ? 1 : 0;
            scene->view()->setLook(look);
            scene->wake();
        };
        QObject::connect(shading, &QComboBox::currentIndexChanged, change);
        QObject::connect(shadows, &QCheckBox::toggled, change);
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
