//! HTTPS: the certificate and its key.

use std::error::Error;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use parking_lot::RwLock;
use tokio::net::TcpStream;
use tokio_rustls::{
    TlsAcceptor,
    rustls::{
        ServerConfig,
        crypto::ring,
        pki_types::{CertificateDer, PrivateKeyDer, pem::PemObject as _},
    },
    server::TlsStream,
};

use crate::cli::failure::{Failure, because_of};

pub(super) struct Tls {
    certificate: PathBuf,
    key: PathBuf,
    acceptor: RwLock<TlsAcceptor>,
}

impl Tls {
    /// Reads certificate and key; `None` if neither is given.
    pub(super) fn open(
        certificate: Option<&Path>,
        key: Option<&Path>,
    ) -> Result<Option<Self>, Box<dyn Error>> {
        match (certificate, key) {
            (None, None) => Ok(None),
            (Some(certificate), Some(key)) => Ok(Some(Self {
                certificate: certificate.to_owned(),
                key: key.to_owned(),
                acceptor: RwLock::new(acceptor(certificate, key)?),
            })),
            _ => Err("TLS needs both --tls-certificate and --tls-key".into()),
        }
    }

    /// Reads the certificate again for new connections. If it is invalid, the old one stays.
    pub(super) fn reload(&self) {
        match acceptor(&self.certificate, &self.key) {
            Ok(renewed) => {
                *self.acceptor.write() = renewed;
                tracing::info!(certificate = %self.certificate.display(), "the certificate was reloaded");
            }
            Err(error) => tracing::error!(%error, "cannot reload the certificate; the old one stays"),
        }
    }

    pub(super) async fn accept(&self, socket: TcpStream) -> io::Result<TlsStream<TcpStream>> {
        let acceptor = self.acceptor.read().clone();
        acceptor.accept(socket).await
    }
}

fn acceptor(certificate: &Path, key: &Path) -> Result<TlsAcceptor, Failure> {
    let chain = CertificateDer::pem_file_iter(certificate).and_then(Iterator::collect::<Result<Vec<_>, _>>);
    let (certificate, key_file) = (certificate.display(), key.display());
    let wrong = because_of(format!("{certificate} is not a PEM file with a certificate"));
    let chain = chain.map_err(wrong)?;
    let wrong = because_of(format!("{key_file} is not a PEM file with a private key"));
    let private = PrivateKeyDer::from_pem_file(key).map_err(wrong)?;
    let config = ServerConfig::builder_with_provider(Arc::new(ring::default_provider()))
        .with_safe_default_protocol_versions()
        .and_then(|builder| builder.with_no_client_auth().with_single_cert(chain, private));
    let mut config = config.map_err(because_of(format!(
        "the certificate in {certificate} does not match the key in {key_file}"
    )))?;
    config.alpn_protocols = vec![b"http/1.1".to_vec()];
    Ok(TlsAcceptor::from(Arc::new(config)))
}
